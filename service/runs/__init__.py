"""What happens when a user says *process*? One input through the pipeline into an event log, now, queued or live."""
