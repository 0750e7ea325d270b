# The engine, as the target mujoco::mujoco: the system's MuJoCo 2.2.2, or with -DDEXCHECK_MUJOCO=FOLDER an unpacked official
# release (include/, lib/) or the folder `mujoco` of a pip installation (include/, libmujoco.so.VERSION).
set(DEXCHECK_MUJOCO "" CACHE PATH "Folder of a MuJoCo release, instead of the system's 2.2.2")
if(NOT DEXCHECK_MUJOCO)
  find_package(mujoco 2.2.2 EXACT REQUIRED)
  return()
endif()
file(GLOB libraries ${DEXCHECK_MUJOCO}/lib/libmujoco.so.* ${DEXCHECK_MUJOCO}/libmujoco.so.*)
if(NOT EXISTS ${DEXCHECK_MUJOCO}/include/mujoco/mujoco.h OR NOT libraries)
  message(FATAL_ERROR "DEXCHECK_MUJOCO: must have include/mujoco/mujoco.h, and libmujoco.so.VERSION in it or in lib/, got "
    "${DEXCHECK_MUJOCO}")
endif()
list(GET libraries 0 library)
string(REGEX REPLACE ".*\\.so\\." "" mujoco_VERSION ${library})
if(NOT mujoco_VERSION VERSION_EQUAL 2.2.2 AND mujoco_VERSION VERSION_LESS 3.2)
  message(FATAL_ERROR "DEXCHECK_MUJOCO: must be MuJoCo 2.2.2, or 3.2 or newer, got ${mujoco_VERSION} in ${DEXCHECK_MUJOCO}")
endif()
if(NOT mujoco_VERSION MATCHES "^(2\\.2\\.2|3\\.12\\.0)$")
  message(WARNING "dexcheck is tested with MuJoCo 2.2.2 and 3.12.0, not with ${mujoco_VERSION}")
endif()
# A copy, whose own TinyXML-2 is not taken for the system's. An installed program has it beside its shipped files.
find_program(DEXCHECK_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
set(copy ${PROJECT_BINARY_DIR}/engine/libmujoco.so.${mujoco_VERSION})
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/engine)
execute_process(COMMAND ${DEXCHECK_PYTHON} ${CMAKE_CURRENT_LIST_DIR}/hide_tinyxml2.py ${library} ${copy}
  COMMAND_ERROR_IS_FATAL ANY)
set(CMAKE_INSTALL_RPATH $ORIGIN/../${CMAKE_INSTALL_LIBDIR}/dexcheck)
install(FILES ${copy} DESTINATION ${CMAKE_INSTALL_LIBDIR}/dexcheck COMPONENT program)
add_library(mujoco::mujoco SHARED IMPORTED GLOBAL)
set_target_properties(mujoco::mujoco PROPERTIES
  IMPORTED_LOCATION ${copy} INTERFACE_INCLUDE_DIRECTORIES ${DEXCHECK_MUJOCO}/include)
