# The shared library trocar::trocar out of all folders and methods, and its installation. Shared, so that a user's
# program needs Eigen and nothing else: the baselines' libraries are private to it.
trocar_write_method_table(${CMAKE_BINARY_DIR}/generated/method_table.cpp)
get_property(trocar_objects GLOBAL PROPERTY TROCAR_OBJECTS)
add_library(trocar SHARED ${CMAKE_BINARY_DIR}/generated/method_table.cpp src/trocar/trocar.cpp)
add_library(trocar::trocar ALIAS trocar)
target_link_libraries(trocar PRIVATE trocar_options ${trocar_objects} PUBLIC Eigen3::Eigen)
target_include_directories(trocar PUBLIC
    $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}/src>
    $<INSTALL_INTERFACE:include>
    $<INSTALL_INTERFACE:include/trocar>)
target_compile_features(trocar PUBLIC cxx_std_20)
# Eigen's alignment and allocator follow -march; fixing both lets a program built with -march=native share matrices with
# this library, which is built for generic x86-64. (Without them such a mix ends in a double free.)
target_compile_definitions(trocar PUBLIC EIGEN_MAX_ALIGN_BYTES=16 EIGEN_MALLOC_ALREADY_ALIGNED=1)
# The predicates' error-free sums stand in headers too: a user's compiler must not fuse them either.
target_compile_options(trocar INTERFACE $<INSTALL_INTERFACE:$<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>>)
set_target_properties(trocar PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR})

include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
install(TARGETS trocar EXPORT trocar_targets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(FILES src/trocar/trocar.hpp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/trocar)
foreach(folder geometry scene contact method)
    install(DIRECTORY src/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/trocar FILES_MATCHING PATTERN "*.hpp")
endforeach()
# What methods outside the clone need: outside.cmake says what it does with it.
install(FILES src/measure/allocations.hpp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/trocar/measure)
install(FILES src/method.cmake src/outside.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/trocar)
install(EXPORT trocar_targets NAMESPACE trocar:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/trocar)
configure_package_config_file(src/trocarConfig.cmake.in ${CMAKE_BINARY_DIR}/generated/trocarConfig.cmake
    INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/trocar PATH_VARS CMAKE_INSTALL_DATADIR CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/generated/trocarConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/generated/trocarConfig.cmake ${CMAKE_BINARY_DIR}/generated/trocarConfigVersion.cmake
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/trocar)
