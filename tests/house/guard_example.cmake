# Installs the build into an empty folder, builds the engine of docs/GUARD.md against it, and does with its recording what
# that text says: the contacts are kept, found to be the same, then lost, moved and changed in the engine's own code.
set(work ${BUILD_DIR}/guard_example)
file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work}/program)
include(${CMAKE_CURRENT_LIST_DIR}/example_parts.cmake)

file(READ ${SOURCE_DIR}/docs/GUARD.md text)
code_block("${text}" "<!-- example: program -->" cpp program)
code_block("${text}" "<!-- example: build -->" cmake build)
code_block("${text}" "<!-- example: write -->" text reported_by_write)
code_block("${text}" "<!-- example: lost -->" text reported_when_lost)
file(WRITE ${work}/program/CMakeLists.txt "${build}")

step(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${work}/installed)

# The engine as the text has it, and again with one line changed, each as a namespace of one program: what it includes
# costs most of building it.
string(REGEX MATCHALL "#include[^\n]*\n" includes "${program}")
string(REGEX REPLACE "#include[^\n]*\n" "" body "${program}")
string(REPLACE "int main()" "int engine()" engine "${body}")
string(REPLACE "recording.finish()" "return recording.finish(), 0" engine "${engine}")
if(engine STREQUAL body)
    message(FATAL_ERROR "docs/GUARD.md lacks int main()")
endif()
string(JOIN "" sources ${includes} "#include <string>\n")
set(choice "")
# engine(NAME FROM TO [FROM TO …])
function(engine name)
    set(changed "${engine}")
    list(LENGTH ARGN count)
    math(EXPR last "${count} - 1")
    foreach(k RANGE 0 ${last} 2)
        list(GET ARGN ${k} from)
        math(EXPR next "${k} + 1")
        list(GET ARGN ${next} to)
        string(FIND "${changed}" "${from}" position)
        if(position EQUAL -1)
            message(FATAL_ERROR "docs/GUARD.md lacks ${from}")
        endif()
        string(REPLACE "${from}" "${to}" changed "${changed}")
    endforeach()
    set(sources "${sources}namespace ${name} {\n${changed}\n}\n" PARENT_SCOPE)
    set(choice "${choice}    if (name == \"${name}\") return ${name}::engine();\n" PARENT_SCOPE)
endfunction()
engine(lost "face < 4" "face < 3")
engine(moved "contact.point = tip" "contact.point = tip * 1.001")
engine(other_triangle "contact.b = 4" "contact.b = 5")
engine(other_push "-= 0.001" "-= 0.0012")
engine(other_push_lost "-= 0.001" "-= 0.0012" "face < 4" "face < 3")
file(WRITE ${work}/program/changed.cpp "${sources}
int main(int, char** words) {
    const std::string name = words[1];
${choice}    return 1;
}
")
file(WRITE ${work}/program/main.cpp "${program}")
file(WRITE ${work}/program/CMakeLists.txt "${build}
add_executable(changed changed.cpp)
target_link_libraries(changed PRIVATE trocar::trocar)
")
step(${CMAKE_COMMAND} -G ${GENERATOR} -S ${work}/program -B ${work}/build
    -D CMAKE_PREFIX_PATH=${work}/installed -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_BUILD_TYPE=Debug)
step(${CMAKE_COMMAND} --build ${work}/build)
# record(words …): lets an engine of the build record.
function(record)
    step(${CMAKE_COMMAND} -E chdir ${work} ${work}/build/${ARGN})
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

record(engine)
baseline(write 0 "${reported_by_write}")
baseline(check 0 " same ")
record(changed lost)
baseline(check 1 "${reported_when_lost}" --junit contacts.xml)
file(READ ${work}/contacts.xml junit)
if(NOT junit MATCHES "failures=.1.")
    message(FATAL_ERROR "the JUnit file reports no failure:\n${junit}")
endif()
record(changed moved)
baseline(check 1 "0 missing, 0 extra")
record(changed other_triangle)
baseline(check 1 "18 missing, 18 extra")
# Another push: the frames are others, and the contacts are right on them; then they are not.
record(changed other_push)
baseline(check 0 "judged by truth alone")
record(changed other_push_lost)
baseline(check 1 " worse ")
