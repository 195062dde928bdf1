# What the tests of the examples in README.md and docs share.

function(step)
    execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
    if(NOT status EQUAL 0)
        message(FATAL_ERROR "${ARGN}\n${output}")
    endif()
endfunction()

# Text between ```LANGUAGE after the marker and the next ```.
function(code_block text marker language result)
    string(FIND "${text}" "${marker}" position)
    if(position EQUAL -1)
        message(FATAL_ERROR "the text lacks ${marker}")
    endif()
    string(SUBSTRING "${text}" ${position} -1 rest)
    string(FIND "${rest}" "```${language}\n" start)
    string(LENGTH "```${language}\n" skip)
    math(EXPR start "${start} + ${skip}")
    string(SUBSTRING "${rest}" ${start} -1 rest)
    string(FIND "${rest}" "```" end)
    string(SUBSTRING "${rest}" 0 ${end} code)
    set(${result} "${code}" PARENT_SCOPE)
endfunction()
