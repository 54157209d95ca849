/*
 * Find a type support handle in this shared library.
 *
 * rosidl_typesupport_c looks for lib<package>__rosidl_typesupport_<implementation>.so on the
 * library path. Here each definition is one library with every implementation in it, so that a
 * learner can add a type to a package that is already loaded. The build renames the two lookups
 * that the generated handles point to (-Drosidl_typesupport_c__get_..._function=course_...),
 * and these take the symbol that the generated map names from the library they are part of.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stddef.h>
#include <string.h>

#include "rosidl_runtime_c/message_type_support_struct.h"
#include "rosidl_runtime_c/service_type_support_struct.h"
#include "rosidl_typesupport_c/type_support_map.h"

typedef const void * (* handle_getter)(void);

static const char anchor = 0;

static const void * find_handle(const type_support_map_t * map, const char * identifier)
{
  Dl_info self;
  if (!dladdr(&anchor, &self)) {
    return NULL;
  }
  for (size_t i = 0; i < map->size; ++i) {
    if (strcmp(map->typesupport_identifier[i], identifier) != 0) {
      continue;
    }
    /* RTLD_NOLOAD: it is loaded, or this code would not run; the count goes back to what it was. */
    void * library = dlopen(self.dli_fname, RTLD_LAZY | RTLD_NOLOAD);
    if (!library) {
      return NULL;
    }
    handle_getter get = (handle_getter)dlsym(library, map->symbol_name[i]);
    dlclose(library);
    return get ? get() : NULL;
  }
  return NULL;
}

const rosidl_message_type_support_t * course_get_message_typesupport_handle(
  const rosidl_message_type_support_t * handle, const char * identifier)
{
  if (strcmp(handle->typesupport_identifier, identifier) == 0) {
    return handle;
  }
  return find_handle(handle->data, identifier);
}

const rosidl_service_type_support_t * course_get_service_typesupport_handle(
  const rosidl_service_type_support_t * handle, const char * identifier)
{
  if (strcmp(handle->typesupport_identifier, identifier) == 0) {
    return handle;
  }
  return find_handle(handle->data, identifier);
}
