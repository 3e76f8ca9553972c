"""Which picture was taken when? Files decoded to timed frames."""
