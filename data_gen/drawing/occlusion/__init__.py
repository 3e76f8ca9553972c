"""What hangs over the road, and what does it hide?"""
