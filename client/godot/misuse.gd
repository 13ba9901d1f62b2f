# What scripts may do wrong with a PneumaWatcher. Each call answers an error or nothing, and Godot goes on. Run by check.
extends SceneTree

const PneumaWatcher = preload("res://pneuma_watcher.gdns")

var failures = 0


func _init():
	var watcher = PneumaWatcher.new()
	expect(watcher.poll() == ERR_UNCONFIGURED, "poll before open")
	expect(watcher.error_text() == "no world is open", "the words of poll before open")
	expect(watcher.open() == ERR_INVALID_PARAMETER, "open with nothing")
	expect(watcher.open("127.0.0.1:1") == ERR_INVALID_PARAMETER, "open without a world")
	expect(watcher.open(7420, "five-balls") == ERR_INVALID_PARAMETER, "open with a number")
	expect(watcher.open("a", "b", "c", "d") == ERR_INVALID_PARAMETER, "open with too much")
	expect(watcher.open("no port", "five-balls") == ERR_INVALID_PARAMETER, "open with no address")
	expect(watcher.open("127.0.0.1:1", "five-balls") == ERR_CANT_CONNECT, "open where nobody listens")
	expect(watcher.error_text().begins_with("127.0.0.1:1: "), "the words of open where nobody listens")
	expect(watcher.poll() != OK, "poll after an open that failed")
	expect(watcher.positions("ball").size() == 0, "positions of no body")
	expect(watcher.faces().size() == 0, "faces without a name")
	expect(watcher.normals(3).size() == 0, "normals of a number")
	expect(watcher.poll("now") == ERR_INVALID_PARAMETER, "poll with an argument")
	expect(watcher.positions("ball", 3).size() == 0, "positions with too much")
	expect(watcher.body_names(3).size() == 0, "body_names with an argument")
	for method in ["close", "error_text", "tick", "time_s"]:
		expect(watcher.call(method, 3) == null, method + " with an argument")
	expect(watcher.body_names().size() == 0 and watcher.tick() == -1, "no frame")
	watcher.close()
	watcher.close()
	print("%d misuses went wrong" % failures)
	quit(1 if failures > 0 else 0)


func expect(is_so, what):
	if not is_so:
		failures += 1
		printerr("misuse: ", what)
