"""Which lists does a log keep beside its runs? Jobs, sources, chronicle texts, deliveries, and who may ask."""
