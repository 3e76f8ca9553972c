"""What do chronicles and monitors find in what is stored, why is an event there, and why is another one not?"""
