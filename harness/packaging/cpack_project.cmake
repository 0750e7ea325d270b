# The archive is one of the program and of all that it needs, and a wheel is made of it; Debian packages are one of each component.
if(CPACK_GENERATOR STREQUAL TXZ)
  set(CPACK_COMPONENTS_ALL program archive)
  set(CPACK_ARCHIVE_COMPONENT_INSTALL ON)
  set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
  set(CPACK_COMPONENT_INCLUDE_TOPLEVEL_DIRECTORY ON)
  set(CPACK_PACKAGING_INSTALL_PREFIX /)
  set(CPACK_POST_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/wheel.cmake)
endif()
