"""Which part of the picture is road, and how large is what is seen there? The road as a raster of cells."""
