# cpack runs this when the archive is made.
find_program(PYTHON python3 REQUIRED)
foreach(archive ${CPACK_PACKAGE_FILES})
  execute_process(COMMAND ${PYTHON} ${CMAKE_CURRENT_LIST_DIR}/make_wheel.py ${archive} ${CPACK_PACKAGE_DIRECTORY}
    COMMAND_ERROR_IS_FATAL ANY)
endforeach()
