"""Which chronicles and streams do the user's texts define, and do they fit the pipeline?"""
