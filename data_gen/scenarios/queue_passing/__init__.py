"""Which scenario has cars that pass a queue? A road whose right lane creeps towards a slow traffic light."""
