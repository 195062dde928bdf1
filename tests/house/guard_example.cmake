# Installs the build into an empty folder, builds the engine of docs/GUARD.md against it, and does with its recording what
# that text says: the contacts are kept, found to be the same, then lost, moved and changed in the engine's own code.
set(work ${BUILD_DIR}/guard_example)
file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work}/program)
include(${CMAKE_CURRENT_LIST_DIR}/example_parts.cmake)

file(READ ${SOURCE_DIR}/docs/GUARD.md text)
code_block("${text}" "<!-- example: program -->" cpp program)
code_block("${text}" "<!-- example: build -->" cmake build)
code_block("${text}" "<!-- example: write -->" text told_by_write)
code_block("${text}" "<!-- example: lost -->" text told_when_lost)
file(WRITE ${work}/program/CMakeLists.txt "${build}")

step(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${work}/installed)

# Builds the engine with one line of it changed and lets it record.
function(record from to)
    string(REPLACE "${from}" "${to}" changed "${program}")
    if(NOT from STREQUAL to AND changed STREQUAL program)
        message(FATAL_ERROR "docs/GUARD.md lacks ${from}")
    endif()
    file(WRITE ${work}/program/main.cpp "${changed}")
    step(${CMAKE_COMMAND} -G ${GENERATOR} -S ${work}/program -B ${work}/build
        -D CMAKE_PREFIX_PATH=${work}/installed -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_BUILD_TYPE=Debug)
    step(${CMAKE_COMMAND} --build ${work}/build)
    step(${CMAKE_COMMAND} -E chdir ${work} ${work}/build/engine)
endfunction()

function(baseline what expected_status expected_output)
    execute_process(COMMAND ${work}/installed/bin/trocar baseline ${what} frames.trocrec ${ARGN} WORKING_DIRECTORY ${work}
        RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
    string(FIND "${output}" "${expected_output}" position)
    if(NOT status EQUAL expected_status OR position EQUAL -1)
        message(FATAL_ERROR "baseline ${what} ended with ${status} and printed\n${output}${errors}\nexpected "
            "${expected_status} and\n${expected_output}")
    endif()
endfunction()

record("face < 4" "face < 4")
baseline(write 0 "${told_by_write}")
baseline(check 0 " same ")
record("face < 4" "face < 3")
baseline(check 1 "${told_when_lost}" --junit contacts.xml)
file(READ ${work}/contacts.xml junit)
if(NOT junit MATCHES "failures=.1.")
    message(FATAL_ERROR "the JUnit file tells no failure:\n${junit}")
endif()
record("contact.point = tip" "contact.point = tip * 1.001")
baseline(check 1 "0 missing, 0 extra")
record("contact.b = 4" "contact.b = 5")
baseline(check 1 "18 missing, 18 extra")
# Another push: the frames are others, and the contacts are right on them; then they are not.
record("-= 0.001;" "-= 0.0012;")
baseline(check 0 "judged by truth alone")
string(REPLACE "face < 4" "face < 3" program "${program}")
record("-= 0.001;" "-= 0.0012;")
baseline(check 1 " worse ")
