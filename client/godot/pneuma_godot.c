/* PneumaWatcher, a class for Godot's scripts: the soft bodies of a world of a server. README.md tells its methods. */
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>

#include "gdnative_minimal.h"
#include "watched_world.h"

#define ENTRY __attribute__((visibility("default")))

static const char class_name[] = "PneumaWatcher";

/* Godot's tables. NULL before it has loaded the library, and where they have another version. */
static const godot_core* core;
static const godot_nativescript* scripting;

/* Values that methods return. */

static godot_variant nil(void) {
  godot_variant made;
  core->variant_new_nil(&made);
  return made;
}

static godot_variant of_int(int64_t number) {
  godot_variant made;
  core->variant_new_int(&made, number);
  return made;
}

static godot_variant of_real(double number) {
  godot_variant made;
  core->variant_new_real(&made, number);
  return made;
}

static godot_variant of_text(const char* text) {
  godot_string string = core->string_of_utf8(text);
  godot_variant made;
  core->variant_new_string(&made, &string);
  core->string_destroy(&string);
  return made;
}

/* What is written, of `size` elements; NULL where there are none, or no memory for them. */
static godot_vectors_write* begin_vectors(godot_vectors* vectors, size_t size) {
  core->vectors_new(vectors);
  if (size == 0 || size > INT_MAX) return NULL;
  core->vectors_resize(vectors, (int)size);
  return core->vectors_write(vectors);
}

static godot_variant end_vectors(godot_vectors* vectors, godot_vectors_write* write) {
  if (write) core->vectors_write_destroy(write);
  godot_variant made;
  core->variant_new_vectors(&made, vectors);
  core->vectors_destroy(vectors);
  return made;
}

static godot_variant end_ints(godot_ints* ints) {
  godot_variant made;
  core->variant_new_ints(&made, ints);
  core->ints_destroy(ints);
  return made;
}

static godot_variant end_strings(godot_strings* strings) {
  godot_variant made;
  core->variant_new_strings(&made, strings);
  core->strings_destroy(strings);
  return made;
}

/* What a method returns of a call that is refused. */

static godot_variant invalid_parameter(void) {
  return of_int(GODOT_ERR_INVALID_PARAMETER);
}

static godot_variant no_vectors(void) {
  godot_vectors vectors;
  godot_vectors_write* write = begin_vectors(&vectors, 0);
  return end_vectors(&vectors, write);
}

static godot_variant no_ints(void) {
  godot_ints ints;
  core->ints_new(&ints);
  return end_ints(&ints);
}

static godot_variant no_strings(void) {
  godot_strings strings;
  core->strings_new(&strings);
  return end_strings(&strings);
}

/* What was asked of a method. */

static const char takes_nothing[] = "takes no arguments";
static const char takes_body[] = "takes the name of a body";
static const char takes_world[] = "takes an address, the name of a world and, where the server wants one, a token";

static godot_variant complain(const char* method, const char* what) {
  char text[256];
  snprintf(text, sizeof text, "%s.%s: %s", class_name, method, what);
  core->print_error(text, method, "pneuma_godot.c", 0);
  return nil();
}

/* The text of a String, to be given back by utf8_destroy. 0 where the argument is no String. */
static int take_text(const godot_variant* argument, godot_utf8* text) {
  if (core->variant_type(argument) != GODOT_TYPE_STRING) return 0;
  godot_string string = core->variant_as_string(argument);
  *text = core->string_as_utf8(&string);
  core->string_destroy(&string);
  return 1;
}

/* The body that a method's only argument names. What is wrong is told to Godot. */
static const watched_body* take_body(const char* method, const watched_world* world, godot_variant** arguments) {
  godot_utf8 name;
  if (!take_text(arguments[0], &name)) {
    complain(method, takes_body);
    return NULL;
  }
  const watched_body* body = watched_world_body(world, core->utf8_text(&name));
  if (!body) complain(method, "the newest frame has no such body");
  core->utf8_destroy(&name);
  return body;
}

static int error_of(pneuma_code code, int otherwise) {
  switch (code) {
    case PNEUMA_OK:
      return GODOT_OK;
    case PNEUMA_INVALID_ARGUMENT:
      return GODOT_ERR_INVALID_PARAMETER;
    case PNEUMA_NOT_FOUND:
      return GODOT_ERR_DOES_NOT_EXIST;
    case PNEUMA_UNAUTHENTICATED:
      return GODOT_ERR_UNAUTHORIZED;
    case PNEUMA_FAILED_PRECONDITION:
      return GODOT_ERR_UNCONFIGURED;
    case PNEUMA_UNAVAILABLE:
      return otherwise;
    default:
      return GODOT_FAILED;
  }
}

/* The methods. */

typedef godot_variant (*method_function)(watched_world* world, int count, godot_variant** arguments);

static godot_variant open_world(watched_world* world, int count, godot_variant** arguments) {
  godot_utf8 texts[3];
  int taken = 0;
  while (taken < count && taken < 3 && take_text(arguments[taken], &texts[taken])) ++taken;
  godot_variant result;
  if (taken == count) {
    const char* token = taken == 3 ? core->utf8_text(&texts[2]) : NULL;
    const pneuma_code code = watched_world_open(world, core->utf8_text(&texts[0]), core->utf8_text(&texts[1]), token);
    result = of_int(error_of(code, GODOT_ERR_CANT_CONNECT));
  } else {
    complain("open", takes_world);
    result = invalid_parameter();
  }
  while (taken > 0) core->utf8_destroy(&texts[--taken]);
  return result;
}

static godot_variant poll_world(watched_world* world, int count, godot_variant** arguments) {
  (void)count, (void)arguments;
  return of_int(error_of(watched_world_poll(world), GODOT_ERR_CONNECTION_ERROR));
}

static godot_variant close_world(watched_world* world, int count, godot_variant** arguments) {
  (void)count, (void)arguments;
  watched_world_close(world);
  return nil();
}

static godot_variant error_text(watched_world* world, int count, godot_variant** arguments) {
  (void)count, (void)arguments;
  char text[sizeof world->error.where + sizeof world->error.what + 2];
  snprintf(text, sizeof text, "%s%s%s", world->error.where, world->error.where[0] ? ": " : "", world->error.what);
  return of_text(text);
}

static godot_variant tick(watched_world* world, int count, godot_variant** arguments) {
  (void)count, (void)arguments;
  return of_int(world->has_frame ? (int64_t)world->tick : -1);
}

static godot_variant time_s(watched_world* world, int count, godot_variant** arguments) {
  (void)count, (void)arguments;
  return of_real(world->time_s);
}

static godot_variant body_names(watched_world* world, int count, godot_variant** arguments) {
  (void)count, (void)arguments;
  godot_strings names;
  core->strings_new(&names);
  for (size_t i = 0; i < world->body_count; ++i) {
    godot_string name = core->string_of_utf8(world->bodies[i].name);
    core->strings_append(&names, &name);
    core->string_destroy(&name);
  }
  return end_strings(&names);
}

static godot_variant positions(watched_world* world, int count, godot_variant** arguments) {
  (void)count;
  const watched_body* body = take_body("positions", world, arguments);
  const size_t size = body ? body->vertex_count : 0;
  godot_vectors vectors;
  godot_vectors_write* write = begin_vectors(&vectors, size);
  godot_vector* to = write ? core->vectors_written(write) : NULL;
  for (size_t i = 0; to && i < size; ++i) {
    const float* from = &body->positions_m[3 * i];
    to[i] = (godot_vector){from[0], from[1], from[2]};
  }
  return end_vectors(&vectors, write);
}

static godot_variant normals(watched_world* world, int count, godot_variant** arguments) {
  (void)count;
  const watched_body* body = take_body("normals", world, arguments);
  const size_t size = body ? body->vertex_count : 0;
  godot_vectors vectors;
  godot_vectors_write* write = begin_vectors(&vectors, size);
  godot_vector* to = write ? core->vectors_written(write) : NULL;
  if (to) watched_body_normals(body, &to->x);
  return end_vectors(&vectors, write);
}

/* Godot shows the side from which a face goes round clockwise. Pneuma's go round the other way. */
static godot_variant faces(watched_world* world, int count, godot_variant** arguments) {
  (void)count;
  const watched_body* body = take_body("faces", world, arguments);
  const size_t size = body ? 3 * body->face_count : 0;
  godot_ints ints;
  core->ints_new(&ints);
  if (size > 0 && size <= INT_MAX) {
    core->ints_resize(&ints, (int)size);
    godot_ints_write* write = core->ints_write(&ints);
    int* to = core->ints_written(write);
    for (size_t i = 0; to && i < size; i += 3) {
      to[i] = (int)body->faces[i];
      to[i + 1] = (int)body->faces[i + 2];
      to[i + 2] = (int)body->faces[i + 1];
    }
    core->ints_write_destroy(write);
  }
  return end_ints(&ints);
}

/* `call` refuses other counts of arguments than these. What the arguments are, the method checks. */
static const struct {
  const char* name;
  method_function function;
  int count_min, count_max;
  const char* takes;
  godot_variant (*refused)(void);
} methods[] = {
    {"open", open_world, 2, 3, takes_world, invalid_parameter},
    {"poll", poll_world, 0, 0, takes_nothing, invalid_parameter},
    {"close", close_world, 0, 0, takes_nothing, nil},
    {"error_text", error_text, 0, 0, takes_nothing, nil},
    {"tick", tick, 0, 0, takes_nothing, nil},
    {"time_s", time_s, 0, 0, takes_nothing, nil},
    {"body_names", body_names, 0, 0, takes_nothing, no_strings},
    {"positions", positions, 1, 1, takes_body, no_vectors},
    {"faces", faces, 1, 1, takes_body, no_ints},
    {"normals", normals, 1, 1, takes_body, no_vectors},
};

/* What Godot calls. */

static void* create(godot_object* object, void* given) {
  (void)object, (void)given;
  return calloc(1, sizeof(watched_world)); /* NULL where there is no memory: `call` answers nothing then */
}

static void destroy(godot_object* object, void* given, void* instance) {
  (void)object, (void)given;
  if (instance) watched_world_close(instance);
  free(instance);
}

static godot_variant call(godot_object* object, void* given, void* instance, int count, godot_variant** arguments) {
  (void)object;
  const size_t index = (size_t)(uintptr_t)given;
  if (!instance) return complain(methods[index].name, "no memory");
  if (count < methods[index].count_min || count > methods[index].count_max) {
    complain(methods[index].name, methods[index].takes);
    return methods[index].refused();
  }
  return methods[index].function(instance, count, arguments);
}

static int is_compatible(const godot_table* table) {
  return table->version.major == 1;
}

/* Another version of Godot's tables is refused: then there is no class, and Godot's scripts are told why. */
ENTRY void godot_gdnative_init(const godot_load* load) {
  const godot_version wanted = {1, 0};
  if (!is_compatible(&load->core->table)) {
    load->report_version_mismatch(load->library, "core", wanted, load->core->table.version);
    return;
  }
  for (unsigned i = 0; i < load->core->extension_count; ++i) {
    const godot_table* table = load->core->extensions[i];
    if (table->type != GODOT_TABLE_NATIVESCRIPT) continue;
    if (is_compatible(table)) {
      core = load->core;
      scripting = (const godot_nativescript*)table;
    } else {
      load->report_version_mismatch(load->library, "nativescript", wanted, table->version);
    }
    return;
  }
  load->report_loading_error(load->library, "this Godot has no NativeScript");
}

ENTRY void godot_gdnative_terminate(const void* options) {
  (void)options;
  core = NULL;
  scripting = NULL;
}

ENTRY void godot_nativescript_init(void* library) {
  if (!scripting) return;
  scripting->register_class(library, class_name, "Reference", (godot_create){.create = create},
                            (godot_destroy){.destroy = destroy});
  for (size_t i = 0; i < sizeof methods / sizeof *methods; ++i) {
    const godot_method method = {.call = call, .given = (void*)(uintptr_t)i};
    scripting->register_method(library, class_name, methods[i].name, (godot_method_attributes){0}, method);
  }
}
