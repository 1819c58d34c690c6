# drift_library(NAME TARGET): an imported library of that name, whose archive is made for the Rust target when it is first linked.
# DRIFT_CARGO_FOLDER, where cargo builds, may be shared between build folders.
set(DRIFT_C "${CMAKE_CURRENT_LIST_DIR}/..")
get_filename_component(DRIFT_C "${DRIFT_C}" ABSOLUTE)

function(drift_library name target)
  set(archive "${CMAKE_CURRENT_BINARY_DIR}/libdrift.a")
  set(build "${DRIFT_CARGO_FOLDER}")
  if(NOT build)
    set(build "${CMAKE_CURRENT_BINARY_DIR}/cargo")
  endif()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${DRIFT_C}/src/*.rs" "${DRIFT_C}/../src/*.rs")
  set(ar "")
  if(CMAKE_AR AND NOT target STREQUAL "host")
    set(ar -D "AR=${CMAKE_AR}")
  endif()
  add_custom_command(
    OUTPUT "${archive}"
    COMMAND "${CMAKE_COMMAND}" -D "TRIPLE=${target}" -D "OUT=${archive}" -D "BUILD=${build}" ${ar}
            -P "${DRIFT_C}/cmake/archive.cmake"
    DEPENDS ${sources} "${DRIFT_C}/Cargo.lock" "${DRIFT_C}/cmake/archive.cmake"
    COMMENT "drift's archive for ${target}"
    VERBATIM)
  add_custom_target(${name}_archive ALL DEPENDS "${archive}")
  add_library(${name} STATIC IMPORTED GLOBAL)
  add_dependencies(${name} ${name}_archive)
  set_target_properties(${name} PROPERTIES
    IMPORTED_LOCATION "${archive}"
    INTERFACE_INCLUDE_DIRECTORIES "${DRIFT_C}/include")
  if(target STREQUAL "host")
    find_package(Threads REQUIRED)
    set_property(TARGET ${name} PROPERTY INTERFACE_LINK_LIBRARIES Threads::Threads ${CMAKE_DL_LIBS} $<$<BOOL:${UNIX}>:m>)
  endif()
endfunction()
