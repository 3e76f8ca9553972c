"""Where is each body, and which lost car can it be? Prediction and joint assignment."""
