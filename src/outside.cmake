# Methods outside a clone: part of the installed package, read by find_package(trocar). Every trocar_add_detector or
# trocar_add_response line (method.cmake) of a project of its own adds its method to two programs of that project:
#   trocar_program        bin/trocar: all of trocar's methods and the project's
#   trocar_contract_test  bin/trocar_contract_test: trocar's contract tests on the project's methods; ctest runs them one by
#                         one where the project says enable_testing(), and the target trocar_contract runs them all
# Both link the installed libraries, so that nothing of trocar is compiled again but two mains.
cmake_policy(VERSION 3.13...3.25)
include(${CMAKE_CURRENT_LIST_DIR}/method.cmake)

# trocar_outside_program(TARGET OUTPUT MAIN LIBRARY)
function(trocar_outside_program target output main library)
    add_executable(${target} ${TROCAR_SHARE}/program/${main} ${TROCAR_SHARE}/program/counting_allocator.cpp)
    target_link_libraries(${target} PRIVATE ${library} trocar::trocar)
    target_compile_definitions(${target} PRIVATE TROCAR_SHARE="${TROCAR_SHARE}")
    set_target_properties(${target} PROPERTIES OUTPUT_NAME ${output} CXX_EXTENSIONS OFF INSTALL_RPATH_USE_LINK_PATH ON)
    if(NOT CMAKE_RUNTIME_OUTPUT_DIRECTORY)
        set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
    endif()
endfunction()

function(trocar_outside_programs)
    if(TARGET trocar_program)
        return()
    endif()
    if(CMAKE_VERSION VERSION_LESS 3.25)
        message(FATAL_ERROR "trocar: methods of a project of its own: expected CMake 3.25 or later, got ${CMAKE_VERSION}")
    endif()
    if(NOT TARGET trocar::app)
        message(FATAL_ERROR "trocar: methods of a project of its own: expected an installation with its program, got one "
            "without (built with TROCAR_CORE)")
    endif()
    if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
        message(STATUS "trocar: no CMAKE_BUILD_TYPE: your methods are compiled without optimisation, their times say nothing")
    endif()
    trocar_outside_program(trocar_program trocar main.cpp trocar::app)
    if(TARGET trocar::contract)
        trocar_outside_program(trocar_contract_test trocar_contract_test contract_main.cpp trocar::contract)
        add_custom_target(trocar_contract COMMAND trocar_contract_test USES_TERMINAL)
        include(GoogleTest)
        gtest_discover_tests(trocar_contract_test DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 300)
    else()
        set(lack "trocar: the contract tests are not installed: they need GTest, and the target trocar_contract built before cmake --install")
        message(STATUS "${lack}")
        add_custom_target(trocar_contract COMMAND ${CMAKE_COMMAND} -E echo "${lack}" COMMAND ${CMAKE_COMMAND} -E false)
    endif()
endfunction()

# trocar_known_gaps(FILE): what the project's methods are known to fail in the contract tests, as in tests/known_gaps.json:
#   {"detectors": [{"method": …, "check": …, "reason": …}], "response_contract": [likewise, METHOD_SOURCE as method]}
# A gap that has closed fails the test.
function(trocar_known_gaps file)
    trocar_outside_programs()
    get_filename_component(file ${file} ABSOLUTE)
    if(TARGET trocar_contract_test)
        target_compile_definitions(trocar_contract_test PRIVATE TROCAR_KNOWN_GAPS="${file}")
    endif()
endfunction()

function(trocar_join_method kind name reason files needs)
    trocar_outside_programs()
    trocar_entry_type(${kind} entry)
    if(reason)
        set(files "")
        set(needs "")
        set(declared "")
        set(joins "registry.add_absent_${kind}({\"${name}\", \"${reason}\"});")
    else()
        set(declared "${entry} ${name}_${kind}();\n")
        set(joins "registry.add(${name}_${kind}());")
    endif()
    set(joining ${CMAKE_CURRENT_BINARY_DIR}/trocar_methods/${kind}_${name}.cpp)
    file(CONFIGURE OUTPUT ${joining} CONTENT
"// Written by CMake from the trocar_add_${kind} line.
#include \"method/outside.hpp\"

namespace trocar {

${declared}namespace {
const OutsideMethod joined([](Registry& registry) { ${joins} });
}  // namespace

}  // namespace trocar
" @ONLY)
    add_library(trocar_${kind}_${name} OBJECT ${joining} ${files})
    target_link_libraries(trocar_${kind}_${name} PRIVATE trocar::trocar ${needs})
    set_target_properties(trocar_${kind}_${name} PROPERTIES CXX_EXTENSIONS OFF)
    foreach(program trocar_program trocar_contract_test)
        if(TARGET ${program})
            target_link_libraries(${program} PRIVATE trocar_${kind}_${name})
        endif()
    endforeach()
endfunction()
