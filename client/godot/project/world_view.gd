# Shows the soft bodies of a world of a server, a mesh each. --server=HOST:PORT and --world=NAME on the command line
# come before what the editor has. The variable PNEUMA_TOKEN has the token, where the server wants one.
extends Spatial

signal shown(watcher)
signal failed(what)

const PneumaWatcher = preload("res://pneuma_watcher.gdns")

export var server = "127.0.0.1:7420"
export var world = "five-balls"

var watcher
var shown_tick = -1
var views = {} # the MeshInstance of each body, by its name


func _ready():
	for argument in OS.get_cmdline_args():
		var parts = argument.split("=", true, 1)
		if parts.size() == 2 and parts[0] in ["--server", "--world"]:
			set(parts[0].substr(2), parts[1])
	set_process(false)
	if not PneumaWatcher.can_instance():
		return fail("libpneuma_godot.so is not there, or not for this Godot")
	watcher = PneumaWatcher.new()
	if watcher.open(server, world, OS.get_environment("PNEUMA_TOKEN")) != OK:
		return fail(watcher.error_text())
	set_process(true)


func _process(_delta):
	if watcher.poll() != OK:
		fail(watcher.error_text())
	elif watcher.tick() != shown_tick:
		shown_tick = watcher.tick()
		show_bodies(watcher.body_names())
		emit_signal("shown", watcher)


func show_bodies(names):
	for name in views.keys():
		if not name in names:
			views[name].queue_free()
			views.erase(name)
	for name in names:
		if not views.has(name):
			views[name] = new_view(views.size())
		var arrays = []
		arrays.resize(ArrayMesh.ARRAY_MAX)
		arrays[ArrayMesh.ARRAY_VERTEX] = watcher.positions(name)
		arrays[ArrayMesh.ARRAY_NORMAL] = watcher.normals(name)
		arrays[ArrayMesh.ARRAY_INDEX] = watcher.faces(name)
		var mesh = ArrayMesh.new()
		mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
		views[name].mesh = mesh


func new_view(index):
	var view = MeshInstance.new()
	view.material_override = SpatialMaterial.new()
	# Steps of the golden ratio keep hues apart, however many there are.
	view.material_override.albedo_color = Color.from_hsv(fmod(0.05 + 0.618 * index, 1.0), 0.6, 0.9)
	add_child(view)
	return view


func fail(what):
	set_process(false)
	$Message.text = what
	printerr(what)
	emit_signal("failed", what)
