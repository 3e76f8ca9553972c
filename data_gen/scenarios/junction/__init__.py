"""Which scenario has queues and turns? A signalised junction of four arms."""
