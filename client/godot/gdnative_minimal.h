/* The part of Godot 3's binary interface for libraries ("GDNative") that pneuma_godot.c uses. Debian packages no header
   of it.

   Godot gives a library tables of functions. A function is known by its place in a table: version 1.0 of a table is
   frozen, and later versions come as tables of their own. Places that are not used here are left out as slots. The
   assertions at the end say which place each used function has. Sizes are those of 64-bit Linux. */
#ifndef PNEUMA_GDNATIVE_MINIMAL_H
#define PNEUMA_GDNATIVE_MINIMAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

_Static_assert(sizeof(void*) == 8, "the sizes below are those of 64-bit systems");

/* Values whose insides are Godot's. */
typedef struct {
  uint64_t opaque[3];
} godot_variant;
typedef struct {
  void* opaque;
} godot_string;
typedef struct {
  void* opaque;
} godot_utf8;
typedef struct {
  void* opaque;
} godot_ints;
typedef struct {
  void* opaque;
} godot_strings;
typedef struct {
  void* opaque;
} godot_vectors;
typedef struct godot_ints_write godot_ints_write;
typedef struct godot_vectors_write godot_vectors_write;
typedef struct godot_object godot_object;

typedef struct {
  float x, y, z;
} godot_vector;

/* What godot_core.variant_type tells. */
enum { GODOT_TYPE_STRING = 4 };

/* Of the codes that Godot's scripts know as OK and ERR_... */
enum {
  GODOT_OK = 0,
  GODOT_FAILED = 1,
  GODOT_ERR_UNCONFIGURED = 3,
  GODOT_ERR_UNAUTHORIZED = 4,
  GODOT_ERR_OUT_OF_MEMORY = 6,
  GODOT_ERR_CANT_CONNECT = 25,
  GODOT_ERR_CONNECTION_ERROR = 27,
  GODOT_ERR_INVALID_PARAMETER = 31,
  GODOT_ERR_DOES_NOT_EXIST = 33
};

typedef struct {
  unsigned major, minor;
} godot_version;

/* How each table begins. */
enum { GODOT_TABLE_CORE = 0, GODOT_TABLE_NATIVESCRIPT = 1 };
typedef struct godot_table {
  unsigned type;
  godot_version version;
  const struct godot_table* next;
} godot_table;

typedef void (*godot_slot)(void);

/* Functions with `made` fill what is not set yet; what they fill is given back by the function with `destroy`. */
typedef struct {
  godot_table table;
  unsigned extension_count;
  const godot_table** extensions;

  godot_slot slots_0[171];
  void (*ints_new)(godot_ints* made);
  godot_slot slots_172[8];
  void (*ints_resize)(godot_ints* ints, int size);
  godot_slot slots_181[1];
  godot_ints_write* (*ints_write)(godot_ints* ints);
  godot_slot slots_183[3];
  void (*ints_destroy)(godot_ints* ints);
  godot_slot slots_187[16];
  void (*strings_new)(godot_strings* made);
  godot_slot slots_204[2];
  void (*strings_append)(godot_strings* strings, const godot_string* string);
  godot_slot slots_207[11];
  void (*strings_destroy)(godot_strings* strings);
  godot_slot slots_219[16];
  void (*vectors_new)(godot_vectors* made);
  godot_slot slots_236[8];
  void (*vectors_resize)(godot_vectors* vectors, int size);
  godot_slot slots_245[1];
  godot_vectors_write* (*vectors_write)(godot_vectors* vectors);
  godot_slot slots_247[3];
  void (*vectors_destroy)(godot_vectors* vectors);
  godot_slot slots_251[49];
  int* (*ints_written)(const godot_ints_write* write);
  godot_slot slots_301[1];
  void (*ints_write_destroy)(godot_ints_write* write);
  godot_slot slots_303[13];
  godot_vector* (*vectors_written)(const godot_vectors_write* write);
  godot_slot slots_317[1];
  void (*vectors_write_destroy)(godot_vectors_write* write);
  godot_slot slots_319[188];
  int (*variant_type)(const godot_variant* variant);
  godot_slot slots_508[1];
  void (*variant_new_nil)(godot_variant* made);
  godot_slot slots_510[2];
  void (*variant_new_int)(godot_variant* made, int64_t number);
  void (*variant_new_real)(godot_variant* made, double number);
  void (*variant_new_string)(godot_variant* made, const godot_string* string);
  godot_slot slots_515[16];
  void (*variant_new_ints)(godot_variant* made, const godot_ints* ints);
  godot_slot slots_532[1];
  void (*variant_new_strings)(godot_variant* made, const godot_strings* strings);
  godot_slot slots_534[1];
  void (*variant_new_vectors)(godot_variant* made, const godot_vectors* vectors);
  godot_slot slots_536[5];
  godot_string (*variant_as_string)(const godot_variant* variant);
  godot_slot slots_542[30];
  const char* (*utf8_text)(const godot_utf8* utf8);
  void (*utf8_destroy)(godot_utf8* utf8);
  godot_slot slots_574[104];
  godot_utf8 (*string_as_utf8)(const godot_string* string);
  godot_slot slots_679[2];
  godot_string (*string_of_utf8)(const char* text);
  godot_slot slots_682[39];
  void (*string_destroy)(godot_string* string);
  godot_slot slots_722[19];
  void (*print_error)(const char* what, const char* function, const char* file, int line);
} godot_core;

#define GODOT_IS_AT(function, place)                                                                               \
  _Static_assert((offsetof(godot_core, function) - offsetof(godot_core, slots_0)) / sizeof(godot_slot) == (place), \
                 #function)
GODOT_IS_AT(ints_new, 171);
GODOT_IS_AT(ints_resize, 180);
GODOT_IS_AT(ints_write, 182);
GODOT_IS_AT(ints_destroy, 186);
GODOT_IS_AT(strings_new, 203);
GODOT_IS_AT(strings_append, 206);
GODOT_IS_AT(strings_destroy, 218);
GODOT_IS_AT(vectors_new, 235);
GODOT_IS_AT(vectors_resize, 244);
GODOT_IS_AT(vectors_write, 246);
GODOT_IS_AT(vectors_destroy, 250);
GODOT_IS_AT(ints_written, 300);
GODOT_IS_AT(ints_write_destroy, 302);
GODOT_IS_AT(vectors_written, 316);
GODOT_IS_AT(vectors_write_destroy, 318);
GODOT_IS_AT(variant_type, 507);
GODOT_IS_AT(variant_new_nil, 509);
GODOT_IS_AT(variant_new_int, 512);
GODOT_IS_AT(variant_new_real, 513);
GODOT_IS_AT(variant_new_string, 514);
GODOT_IS_AT(variant_new_ints, 531);
GODOT_IS_AT(variant_new_strings, 533);
GODOT_IS_AT(variant_new_vectors, 535);
GODOT_IS_AT(variant_as_string, 541);
GODOT_IS_AT(utf8_text, 572);
GODOT_IS_AT(utf8_destroy, 573);
GODOT_IS_AT(string_as_utf8, 678);
GODOT_IS_AT(string_of_utf8, 681);
GODOT_IS_AT(string_destroy, 721);
GODOT_IS_AT(print_error, 741);

/* What Godot calls, and what it gives back with each call. `release` may be NULL. */
typedef struct {
  void* (*create)(godot_object* object, void* given);
  void* given;
  void (*release)(void* given);
} godot_create;
typedef struct {
  void (*destroy)(godot_object* object, void* given, void* instance);
  void* given;
  void (*release)(void* given);
} godot_destroy;
typedef struct {
  godot_variant (*call)(godot_object* object, void* given, void* instance, int argument_count,
                        godot_variant** arguments);
  void* given;
  void (*release)(void* given);
} godot_method;
typedef struct {
  int remote_calls; /* 0: none */
} godot_method_attributes;

/* The table that registers classes. `library` is what godot_nativescript_init was given. */
typedef struct {
  godot_table table;
  void (*register_class)(void* library, const char* name, const char* base, godot_create create, godot_destroy destroy);
  godot_slot slots_1[1];
  void (*register_method)(void* library, const char* class_name, const char* name, godot_method_attributes attributes,
                          godot_method method);
} godot_nativescript;

/* What a library is given when it is loaded. */
typedef struct {
  bool in_editor;
  uint64_t hashes[3];
  void (*report_version_mismatch)(const godot_object* library, const char* what, godot_version wanted,
                                  godot_version had);
  void (*report_loading_error)(const godot_object* library, const char* what);
  godot_object* library;
  const godot_core* core;
  const godot_string* library_path;
} godot_load;

#endif
