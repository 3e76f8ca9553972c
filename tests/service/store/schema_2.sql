BEGIN TRANSACTION;
CREATE TABLE car_states (
	run_no INTEGER NOT NULL, 
	t_us BIGINT NOT NULL, 
	car TEXT NOT NULL, 
	x_m FLOAT NOT NULL, 
	y_m FLOAT NOT NULL, 
	heading_rad FLOAT NOT NULL, 
	speed_mps FLOAT NOT NULL, 
	length_m FLOAT NOT NULL, 
	width_m FLOAT NOT NULL, 
	car_class TEXT NOT NULL, 
	road TEXT NOT NULL, 
	along_m FLOAT, 
	lane TEXT NOT NULL, 
	linked BOOLEAN NOT NULL, 
	vision_id TEXT NOT NULL, 
	PRIMARY KEY (run_no, t_us, car)
)
 WITHOUT ROWID

;
INSERT INTO "car_states" VALUES(1,0,'car10',9.0,5.0,0.0,13.9,4.5,1.8,'car','road1',9.0,'road1_0',1,'v1');
INSERT INTO "car_states" VALUES(1,0,'car7',1.0,2.0,0.0,13.9,4.5,1.8,'car','road1',1.0,'road1_0',1,'v1');
INSERT INTO "car_states" VALUES(1,40000,'car10',9.0,5.0,0.0,13.9,4.5,1.8,'car','road1',9.0,'road1_0',1,'v1');
INSERT INTO "car_states" VALUES(1,40000,'car7',2.0,2.0,0.0,13.9,4.5,1.8,'car','road1',2.0,'road1_0',1,'v1');
INSERT INTO "car_states" VALUES(1,80000,'car10',9.0,5.0,0.0,13.9,4.5,1.8,'car','road1',9.0,'road1_0',0,'v1');
INSERT INTO "car_states" VALUES(1,80000,'car7',3.0,2.0,0.0,13.9,4.5,1.8,'car','road1',3.0,'road1_0',1,'v1');
CREATE TABLE cars (
	run_no INTEGER NOT NULL, 
	car TEXT NOT NULL, 
	number INTEGER NOT NULL, 
	car_class TEXT NOT NULL, 
	first_us BIGINT NOT NULL, 
	last_us BIGINT NOT NULL, 
	PRIMARY KEY (run_no, car)
)
 WITHOUT ROWID

;
INSERT INTO "cars" VALUES(1,'car10',2,'car',0,80000);
INSERT INTO "cars" VALUES(1,'car7',1,'car',0,80000);
CREATE TABLE costs (
	run_no INTEGER NOT NULL, 
	number INTEGER NOT NULL, 
	label TEXT NOT NULL, 
	busy_us BIGINT NOT NULL, 
	PRIMARY KEY (run_no, number)
);
CREATE TABLE durations (
	run_no INTEGER NOT NULL, 
	type TEXT NOT NULL, 
	longest_us BIGINT NOT NULL, 
	PRIMARY KEY (run_no, type)
)
 WITHOUT ROWID

;
INSERT INTO "durations" VALUES(1,'overtake',3000000);
INSERT INTO "durations" VALUES(1,'pass',3000000);
CREATE TABLE event_roles (
	seq BIGINT NOT NULL, 
	role TEXT NOT NULL, 
	actor TEXT NOT NULL, 
	start_us BIGINT NOT NULL, 
	PRIMARY KEY (seq, role)
)
 WITHOUT ROWID

;
INSERT INTO "event_roles" VALUES(1,'overtaken','car3',12000000);
INSERT INTO "event_roles" VALUES(2,'overtaken','car3',40000000);
INSERT INTO "event_roles" VALUES(1,'overtaker','car7',12000000);
INSERT INTO "event_roles" VALUES(2,'overtaker','car7',40000000);
CREATE TABLE events (
	seq INTEGER NOT NULL, 
	id TEXT NOT NULL, 
	run_no INTEGER NOT NULL, 
	type TEXT NOT NULL, 
	source TEXT NOT NULL, 
	start_us BIGINT NOT NULL, 
	end_us BIGINT NOT NULL, 
	start_utc_us BIGINT NOT NULL, 
	road TEXT NOT NULL, 
	status TEXT NOT NULL, 
	body TEXT NOT NULL, 
	PRIMARY KEY (seq), 
	UNIQUE (id)
);
INSERT INTO "events" VALUES(1,'r1-1',1,'overtake','demo.mp4',12000000,15000000,1777622412000000,'road1','recognised','{"id":"r1-1","seq":1,"type":"overtake","chronicle":{"name":"overtake","version":"v1"},"source":"demo.mp4","run":"r1","start":"2026-05-01T08:00:12.000000Z","end":"2026-05-01T08:00:15.000000Z","start_us":12000000,"end_us":15000000,"roles":{"overtaker":"car7","overtaken":"car3"},"status":"recognised","hypotheses":["h1","h2"],"sub_events":[{"label":"begin","t_us":12000000},{"label":"end","t_us":15000000}],"place":{"road":"road1","x_m":10.5,"y_m":-2.25},"recognised_us":16000000,"revises":null}');
INSERT INTO "events" VALUES(2,'r1-2',1,'pass','demo.mp4',40000000,43000000,1777622440000000,'','recognised','{"id":"r1-2","seq":2,"type":"pass","chronicle":{"name":"overtake","version":"v1"},"source":"demo.mp4","run":"r1","start":"2026-05-01T08:00:40.000000Z","end":"2026-05-01T08:00:43.000000Z","start_us":40000000,"end_us":43000000,"roles":{"overtaker":"car7","overtaken":"car3"},"status":"recognised","hypotheses":["h1","h2"],"sub_events":[{"label":"begin","t_us":40000000},{"label":"end","t_us":43000000}],"place":null,"recognised_us":44000000,"revises":null}');
CREATE TABLE frames (
	run_no INTEGER NOT NULL, 
	number INTEGER NOT NULL, 
	t_us BIGINT NOT NULL, 
	PRIMARY KEY (run_no, number)
)
 WITHOUT ROWID

;
INSERT INTO "frames" VALUES(1,1,0);
INSERT INTO "frames" VALUES(1,2,40000);
INSERT INTO "frames" VALUES(1,3,80000);
CREATE TABLE hypotheses (
	run_no INTEGER NOT NULL, 
	number INTEGER NOT NULL, 
	t_us BIGINT NOT NULL, 
	label TEXT NOT NULL, 
	verdict TEXT NOT NULL, 
	PRIMARY KEY (run_no, number)
);
CREATE TABLE links (
	run_no INTEGER NOT NULL, 
	number INTEGER NOT NULL, 
	t_us BIGINT NOT NULL, 
	kind TEXT NOT NULL, 
	level TEXT NOT NULL, 
	lower TEXT NOT NULL, 
	upper TEXT NOT NULL, 
	reason TEXT NOT NULL, 
	PRIMARY KEY (run_no, number)
);
INSERT INTO "links" VALUES(1,1,0,'established','car','o1','car7','seen for 0.5 s');
CREATE TABLE meta (
	"key" TEXT NOT NULL, 
	value TEXT NOT NULL, 
	PRIMARY KEY ("key")
);
INSERT INTO "meta" VALUES('application','dyknow event log');
INSERT INTO "meta" VALUES('schema_version','2');
INSERT INTO "meta" VALUES('last_seq','2');
CREATE TABLE relations (
	run_no INTEGER NOT NULL, 
	number INTEGER NOT NULL, 
	t_us BIGINT NOT NULL, 
	decided_us BIGINT NOT NULL, 
	name TEXT NOT NULL, 
	args TEXT NOT NULL, 
	old TEXT NOT NULL, 
	new TEXT NOT NULL, 
	hypotheses TEXT NOT NULL, 
	PRIMARY KEY (run_no, number)
);
INSERT INTO "relations" VALUES(1,1,10000,40000,'behind','["car7","car10"]','unknown','true','["v1->w1#1"]');
INSERT INTO "relations" VALUES(1,2,20000,40000,'moving','["car7"]','false','true','[]');
INSERT INTO "relations" VALUES(1,3,30000,40000,'turn','["car7","from","j1"]','unknown','left','[]');
CREATE TABLE revisions (
	run_no INTEGER NOT NULL, 
	revised TEXT NOT NULL, 
	PRIMARY KEY (revised)
)
 WITHOUT ROWID

;
CREATE TABLE role_names (
	run_no INTEGER NOT NULL, 
	type TEXT NOT NULL, 
	role TEXT NOT NULL, 
	PRIMARY KEY (run_no, type, role)
)
 WITHOUT ROWID

;
INSERT INTO "role_names" VALUES(1,'overtake','overtaken');
INSERT INTO "role_names" VALUES(1,'overtake','overtaker');
INSERT INTO "role_names" VALUES(1,'pass','overtaken');
INSERT INTO "role_names" VALUES(1,'pass','overtaker');
CREATE TABLE runs (
	run_no INTEGER NOT NULL, 
	id TEXT NOT NULL, 
	source TEXT NOT NULL, 
	start_utc_us BIGINT NOT NULL, 
	status TEXT NOT NULL, 
	reason TEXT NOT NULL, 
	body TEXT NOT NULL, 
	PRIMARY KEY (run_no), 
	UNIQUE (id)
);
INSERT INTO "runs" VALUES(1,'r1','demo.mp4',1777622400000000,'finished','','{"id":"r1","source":"demo.mp4","start_utc_us":1777622400000000,"input_kind":"video","input":"","site":"","detector":"","camera":{"pixel_from_ground":[10.0,0.0,100.0,0.0,-10.0,200.0,0.0,0.0,1.0],"width_px":640,"height_px":360},"chronicles":[{"name":"overtake","version":"v1","parameters":["overtaker","overtaken"],"text":"chronicle overtake[?overtaker,?overtaken]() {}","file":"overtake.chronicle"}],"monitors":[],"texts":[],"relations":[],"kpl":"","settings":{},"warnings":[],"software":"","status":"running","reason":""}');
CREATE TABLE seen_objects (
	run_no INTEGER NOT NULL, 
	t_us BIGINT NOT NULL, 
	vision_id TEXT NOT NULL, 
	x_m FLOAT NOT NULL, 
	y_m FLOAT NOT NULL, 
	heading_rad FLOAT NOT NULL, 
	length_m FLOAT NOT NULL, 
	width_m FLOAT NOT NULL, 
	observed BOOLEAN NOT NULL, 
	clipped BOOLEAN NOT NULL, 
	PRIMARY KEY (run_no, t_us, vision_id)
)
 WITHOUT ROWID

;
CREATE TABLE streams (
	run_no INTEGER NOT NULL, 
	number INTEGER NOT NULL, 
	body TEXT NOT NULL, 
	PRIMARY KEY (run_no, number)
);
CREATE TABLE views (
	run_no INTEGER NOT NULL, 
	t_us BIGINT NOT NULL, 
	pixel_from_ground TEXT NOT NULL, 
	PRIMARY KEY (run_no, t_us)
)
 WITHOUT ROWID

;
CREATE INDEX event_roles_by_actor ON event_roles (actor, start_us, seq, role);
CREATE INDEX events_by_road ON events (road, start_us, seq);
CREATE INDEX events_by_run ON events (run_no, start_us, seq);
CREATE INDEX events_by_source ON events (source, start_us, seq);
CREATE INDEX events_by_start ON events (start_us, seq);
CREATE INDEX events_by_type ON events (type, start_us, seq);
CREATE INDEX links_by_upper ON links (run_no, upper, number);
CREATE INDEX relations_by_name ON relations (run_no, name, t_us);
COMMIT;
