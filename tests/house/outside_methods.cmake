# A project of its own in an empty folder, as docs/LIBRARY.md shows it: a detector and a response (the two files to copy), and beyond
# that page a detector that loses a pair and one whose library is missing, built against the installed tree. The program has
# them all, runs with them, and the contract tests pass the good and fail the bad.
if(NOT EXISTS ${BUILD_DIR}/lib/libtrocar_contract.so)
    message(STATUS "skipped: the target trocar_contract is not built")
    return()
endif()
set(work ${BUILD_DIR}/outside_methods)
file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work}/project ${work}/elsewhere)
set(ENV{TROCAR_SHARE} "")
include(${CMAKE_CURRENT_LIST_DIR}/example_parts.cmake)

# expect(STATUS PATTERN words …): the command ends so and prints the pattern.
function(expect status pattern)
    execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${work}/elsewhere
        RESULT_VARIABLE got OUTPUT_VARIABLE output ERROR_VARIABLE output)
    if(NOT got EQUAL status OR NOT output MATCHES "${pattern}")
        message(FATAL_ERROR "${ARGN}: status ${got} instead of ${status}, or not ${pattern} in\n${output}")
    endif()
endfunction()

# copy_method(FROM TO KIND NAME [THIS THAT]): the example, called otherwise and with THIS replaced.
function(copy_method from to kind name)
    file(READ ${SOURCE_DIR}/baselines/${from} text)
    string(REPLACE "example_${kind}()" "${name}_${kind}()" text "${text}")
    string(REPLACE "name = \"example\"" "name = \"${name}\"" text "${text}")
    if(ARGC GREATER 4)
        # By position: as a list both would end at their semicolons.
        string(FIND "${text}" "${ARGV4}" position)
        if(position EQUAL -1)
            message(FATAL_ERROR "baselines/${from} lacks ${ARGV4}")
        endif()
        string(REPLACE "${ARGV4}" "${ARGV5}" text "${text}")
    endif()
    file(WRITE ${work}/project/${to} "${text}")
endfunction()
copy_method(example.cpp my_detector.cpp detector my_detector)
copy_method(example.cpp other.cpp detector careless
    "contacts.sort();" "contacts.sort(); if (contacts.pairs.size() > 20) contacts.pairs.pop_back();")
copy_method(example_response.cpp my_response.cpp response my_response)
# The example response of version 0.2, carried over as docs/migrating_0.3.md says.
execute_process(COMMAND sed -E -f ${SOURCE_DIR}/docs/migrating_0.3.sed ${SOURCE_DIR}/tests/house/example_response_0.2.txt
    OUTPUT_VARIABLE carried COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE "example_response()" "carried_response()" carried "${carried}")
string(REPLACE "name = \"example\"" "name = \"carried\"" carried "${carried}")
file(WRITE ${work}/project/carried.cpp "${carried}")
file(READ ${SOURCE_DIR}/docs/LIBRARY.md library)
code_block("${library}" "<!-- example: methods -->" cmake project)
file(WRITE ${work}/project/CMakeLists.txt "${project}
trocar_add_detector(careless other.cpp)
trocar_add_detector(homeless NEEDS no::such_library)
trocar_add_response(carried carried.cpp)
trocar_known_gaps(gaps.json)
")
file(WRITE ${work}/project/gaps.json "{\"detectors\": [
    {\"method\": \"careless\", \"check\": \"WindingMakesNoDifference\", \"reason\": \"none: it loses the same pair either way\"},
    {\"method\": \"careless\", \"check\": \"LongTrianglesAreFound\", \"reason\": \"it loses the last pair\"}]}")

step(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${work}/installed)
set(configure ${CMAKE_COMMAND} -G ${GENERATOR} -S ${work}/project -D CMAKE_PREFIX_PATH=${work}/installed
    -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_BUILD_TYPE=Release
    # Nothing here is timed, and the pairs are the same at any level.
    -D CMAKE_CXX_FLAGS_RELEASE=-O0)
step(${configure} -B ${work}/build -D CMAKE_EXPORT_COMPILE_COMMANDS=ON)
# Flags that the answers depend on come along.
file(READ ${work}/build/compile_commands.json commands)
foreach(flag -ffp-contract=off -std=c\\+\\+20 EIGEN_MAX_ALIGN_BYTES=16)
    if(NOT commands MATCHES "${flag}[^\n]*my_detector.cpp")
        message(FATAL_ERROR "${flag} is not among the flags of my_detector.cpp:\n${commands}")
    endif()
endforeach()
step(${CMAKE_COMMAND} --build ${work}/build --parallel 2)

set(program ${work}/build/bin/trocar)
expect(0 "ohc_clustered .*my_detector .*careless .*homeless +absent \\(library not found: no::such_library\\).*unilateral .*my_response "
    ${program} list)
expect(0 "ohc_clustered . my_response, tracked_proximity" ${program} run i2t_poke --ticks 400 --response my_response)
# The carried response does what the present one does.
foreach(response carried my_response)
    execute_process(COMMAND ${program} run i2t_poke --ticks 500 --response ${response}
        OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
    if(NOT output MATCHES "state +([0-9a-f]+)")
        message(FATAL_ERROR "no state hash in\n${output}")
    endif()
    set(hash_of_${response} ${CMAKE_MATCH_1})
endforeach()
if(NOT hash_of_carried STREQUAL hash_of_my_response)
    message(FATAL_ERROR "carried ends at ${hash_of_carried}, my_response at ${hash_of_my_response}")
endif()
expect(0 "my_detector . penalty, intersection" ${program} run i2t_poke --ticks 400 --detector my_detector --response penalty --contacts intersection)
expect(0 "ohc_clustered . unilateral, tracked_proximity" ${program} run i2t_poke --ticks 5)
expect(2 "homeless.*absent \\(library not found: no::such_library\\)" ${program} run i2t_poke --detector homeless)

set(tests ${work}/build/bin/trocar_contract_test)
expect(0 "DetectorContract.*my_detector_SamePairsAsTheOracle.*ResponseContract.*my_response_tracked_proximity_ActionIsReaction"
    ${tests} --gtest_list_tests)
expect(0 "PASSED" ${tests} "--gtest_filter=*/my_*")
expect(1 "1 of [0-9]+ pairs missing" ${tests} "--gtest_filter=*/careless_SamePairs*")
# The project's own known gaps: one that holds, one that does not.
expect(0 "known gap: it loses the last pair" ${tests} "--gtest_filter=*/careless_LongTriangles*")
expect(1 "the known gap is closed" ${tests} "--gtest_filter=*/careless_Winding*")
# By ctest, under the same names.
step(${CMAKE_CTEST_COMMAND} --test-dir ${work}/build -R DetectorContract.*my_detector_SamePairs)
if(NOT output MATCHES "100% tests passed, 0 tests failed out of 1\n")
    message(FATAL_ERROR "${output}")
endif()

# A name that trocar has is refused in a line, by both programs.
copy_method(example.cpp my_detector.cpp detector my_detector "name = \"my_detector\"" "name = \"ohc\"")
step(${CMAKE_COMMAND} --build ${work}/build --parallel 2)
expect(2 "^trocar: methods of this program: expected names that no other method has, got two detectors are named 'ohc'\n$"
    ${program} list)
expect(2 "^contract tests: methods of this program: expected names that no other method has, got [^\n]*\n$" ${tests})

# Without the contract library everything else is there, and the target says what is missing.
file(REMOVE ${work}/installed/${LIBDIR}/libtrocar_contract.so)
set(lack "the contract tests are not installed: they need GTest")
step(${configure} -B ${work}/bare)
if(NOT output MATCHES "${lack}")
    message(FATAL_ERROR "${output}")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} --build ${work}/bare --target trocar_contract
    RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(status EQUAL 0 OR NOT output MATCHES "${lack}")
    message(FATAL_ERROR "trocar_contract: status ${status}\n${output}")
endif()
