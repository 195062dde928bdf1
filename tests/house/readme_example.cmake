# Installs the build into an empty folder, takes the C++ example and the CMake example out of docs/LIBRARY.md, builds them
# against the installed package and compares the output with the one that it shows.
set(work ${BUILD_DIR}/readme_example)
file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work}/program)

include(${CMAKE_CURRENT_LIST_DIR}/example_parts.cmake)

file(READ ${SOURCE_DIR}/docs/LIBRARY.md library)
code_block("${library}" "<!-- example: program -->" cpp program)
code_block("${library}" "<!-- example: build -->" cmake build)
code_block("${library}" "<!-- example: output -->" text expected)
file(WRITE ${work}/program/main.cpp "${program}")
file(WRITE ${work}/program/CMakeLists.txt "${build}")

step(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${work}/installed)
step(${CMAKE_COMMAND} -G ${GENERATOR} -S ${work}/program -B ${work}/build
    -D CMAKE_PREFIX_PATH=${work}/installed -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_BUILD_TYPE=Release)
step(${CMAKE_COMMAND} --build ${work}/build)
execute_process(COMMAND ${work}/build/two_tetrahedra RESULT_VARIABLE status OUTPUT_VARIABLE output)
if(NOT status EQUAL 0 OR NOT output STREQUAL expected)
    message(FATAL_ERROR "the example printed\n${output}\ndocs/LIBRARY.md shows\n${expected}")
endif()
