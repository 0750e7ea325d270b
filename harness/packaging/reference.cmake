# Target `reference`: pages of all installed headers, in reference/html of the build folder. A warning is an error.
find_program(DEXCHECK_DOXYGEN doxygen)
if(DEXCHECK_DOXYGEN)
  get_property(DOXYGEN_INPUT GLOBAL PROPERTY DEXCHECK_INSTALLED_FOLDERS)
  list(JOIN DOXYGEN_INPUT " " DOXYGEN_INPUT)
  set(DOXYGEN_OUTPUT ${PROJECT_BINARY_DIR}/reference)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/Doxyfile.in ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)
  file(MAKE_DIRECTORY ${DOXYGEN_OUTPUT})
  add_custom_target(reference COMMAND ${DEXCHECK_DOXYGEN} ${PROJECT_BINARY_DIR}/Doxyfile
    COMMENT "Pages of the installed headers: ${DOXYGEN_OUTPUT}/html/index.html" VERBATIM)
endif()
