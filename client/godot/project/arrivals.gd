# With --frames=N on the command line: prints N frames as they arrive, and ends. The exit code is 0. If they do not come
# or nothing moves, it is 1 and a line says why. Runs without a screen (godot3-server), too.
extends Node

const WAIT_S = 10.0

var frames = 0
var waited_s = 0.0
var told = 0
var moved_m = 0.0
var last = {} # positions by body


func _ready():
	for argument in OS.get_cmdline_args():
		if argument.begins_with("--frames="):
			frames = int(argument.substr(9))
			if frames <= 0:
				printerr("arrivals: %s: a number of frames is wanted" % argument)
				return get_tree().quit(1)
	set_process(frames > 0)
	if frames > 0:
		get_parent().connect("shown", self, "tell")
		get_parent().connect("failed", self, "end")


func _process(delta):
	waited_s += delta
	if waited_s > WAIT_S:
		end("%d of %d frames in %d s; is the world paused?" % [told, frames, WAIT_S])


func tell(watcher):
	var line = "tick %d, %.2f s:" % [watcher.tick(), watcher.time_s()]
	for name in watcher.body_names():
		var positions = watcher.positions(name)
		var seen = look_at_faces(positions, watcher.normals(name), watcher.faces(name))
		line += "  %s %d vertices %.3f m3" % [name, positions.size(), seen.volume_m3]
		if seen.alignment <= 0:
			return end("the normals of %s point to where its faces are not seen from" % name)
		if last.has(name):
			moved_m = max(moved_m, positions[0].distance_to(last[name][0]))
		last[name] = positions
	print(line)
	told += 1
	if told == frames:
		print("%d frames, %d bodies, a vertex moved %.4f m between two" % [told, last.size(), moved_m])
		end("" if moved_m > 0 else "nothing moved")


# Godot's own planes say from which side a face is seen. The volume of a closed mesh, by Gauss' theorem: it is negative
# where the faces are seen from inside.
func look_at_faces(positions, normals, faces):
	var seen = {volume_m3 = 0.0, alignment = 0.0}
	for i in range(0, faces.size(), 3):
		var a = positions[faces[i]]
		var b = positions[faces[i + 1]]
		var c = positions[faces[i + 2]]
		var plane = Plane(a, b, c)
		seen.volume_m3 += (b - a).cross(c - a).length() / 2 * plane.d / 3
		seen.alignment += plane.normal.dot(normals[faces[i]])
	return seen


func end(what):
	if not is_processing():
		return
	set_process(false)
	if what:
		printerr("arrivals: ", what)
	get_tree().quit(1 if what else 0)
