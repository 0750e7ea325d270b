# What find_package(dexcheck) reads, and the Debian packages (cpack in the build folder): dexcheck is the program with its
# shipped files, libdexcheck-dev the libraries with their headers.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/dexcheck)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/dexcheckConfig.cmake.in
  ${PROJECT_BINARY_DIR}/dexcheckConfig.cmake INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/dexcheckConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/dexcheckConfig.cmake ${PROJECT_BINARY_DIR}/dexcheckConfigVersion.cmake
  ${CMAKE_CURRENT_LIST_DIR}/dexcheckConsistencyTest.cmake
  DESTINATION ${package_folder} COMPONENT development)
install(EXPORT dexcheckController NAMESPACE dexcheck:: DESTINATION ${package_folder} COMPONENT development)
if(DEXCHECK_BUILD_HARNESS)
  install(EXPORT dexcheckHarness NAMESPACE dexcheck:: DESTINATION ${package_folder} COMPONENT development)
endif()

install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libdexcheck-dev RENAME copyright
  COMPONENT development)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_CONTACT "dexcheck developers <dexcheck@users.noreply.github.com>")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL development)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libdexcheck-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "analytic robot models against MuJoCo: libraries and headers")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev, libtomlplusplus-dev")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS "libmujoco-dev, libgl-dev, libqhull-dev, libhdf5-dev, \
libfmt-dev, nlohmann-json3-dev, liburdfdom-dev, libtinyxml2-dev, libsqlite3-dev, libsqlitecpp-dev, \
libzip-dev, liblz4-dev, libzstd-dev, pkg-config")
if(DEXCHECK_BUILD_RENDERS)
  list(APPEND CPACK_COMPONENTS_ALL program)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/dexcheck RENAME copyright
    COMPONENT program)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME dexcheck)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
  set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "checks analytic robot models and controllers against MuJoCo")
  # Which libraries the program needs is read from it; what it loads, runs and reads besides is this.
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "ffmpeg, gnuplot-nox, fonts-dejavu-core, libosmesa6")
endif()
if(DEXCHECK_ENGINES)
  list(APPEND CPACK_COMPONENTS_ALL engines)
  set(CPACK_DEBIAN_ENGINES_PACKAGE_NAME dexcheck-engines)
  set(CPACK_DEBIAN_ENGINES_PACKAGE_SECTION science)
  set(CPACK_COMPONENT_ENGINES_DESCRIPTION "physics engines that dexcheck engines asks")
  set(CPACK_DEBIAN_ENGINES_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_ENGINES_PACKAGE_SUGGESTS "nodejs")
endif()
include(CPack)
