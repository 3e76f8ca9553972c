"""What is asked over HTTP, and what is answered? Parameters, bodies and errors, for requests and for OpenAPI alike."""
