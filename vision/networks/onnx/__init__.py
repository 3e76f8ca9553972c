"""Networks in ONNX: what goes in, what comes out, and the boxes it makes of a picture."""
