"""When can the time points of a chronicle be, relative to each other?"""
