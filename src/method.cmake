# How a method joins, in trocar and in a project of its own: one line,
#
#     trocar_add_detector(NAME [FILE …] [NEEDS target …] [SOURCES FILE …])
#
# or trocar_add_response(…), trocar_add_contact_generator(…), trocar_add_stepper(…). The method is NAME.cpp beside the line, or the
# files named; SOURCES come on top. It defines, in namespace trocar, `DetectorEntry NAME_detector()`, `ResponseEntry
# NAME_response()`, `ContactGeneratorEntry NAME_contact_generator()` or `StepperEntry NAME_stepper()`; a wrong name is a link error. A method
# whose library is missing stays visible: it is listed as absent with the reason.
#
# What happens to it then is the including file's: trocar_join_method(KIND NAME REASON FILES NEEDS), where a REASON says
# that it is absent.

function(trocar_add_method kind name)
    cmake_parse_arguments(METHOD "" "REASON" "NEEDS;SOURCES" ${ARGN})
    set(missing "")
    foreach(target ${METHOD_NEEDS})
        if(NOT TARGET ${target})
            list(APPEND missing ${target})
        endif()
    endforeach()
    set(reason "${METHOD_REASON}")
    if(missing AND NOT reason)
        if(DEFINED TROCAR_FOREIGN AND NOT TROCAR_FOREIGN)
            set(reason "built without foreign libraries")
        else()
            list(JOIN missing ", " missing_text)
            set(reason "library not found: ${missing_text}")
        endif()
    endif()
    if(reason)
        message(STATUS "trocar: ${kind} ${name} absent (${reason})")
    endif()
    set(files ${METHOD_UNPARSED_ARGUMENTS})
    if(NOT files)
        set(files ${name}.cpp)
    endif()
    trocar_join_method(${kind} ${name} "${reason}" "${files};${METHOD_SOURCES}" "${METHOD_NEEDS}")
endfunction()

# DetectorEntry, ContactGeneratorEntry, …
function(trocar_entry_type kind result)
    string(REPLACE "_" ";" words ${kind})
    set(type "")
    foreach(word ${words})
        string(SUBSTRING ${word} 0 1 first)
        string(SUBSTRING ${word} 1 -1 rest)
        string(TOUPPER ${first} first)
        string(APPEND type ${first}${rest})
    endforeach()
    set(${result} ${type}Entry PARENT_SCOPE)
endfunction()

function(trocar_add_detector name)
    trocar_add_method(detector ${name} ${ARGN})
endfunction()

function(trocar_add_response name)
    trocar_add_method(response ${name} ${ARGN})
endfunction()

# A contact generator.
function(trocar_add_contact_generator name)
    trocar_add_method(contact_generator ${name} ${ARGN})
endfunction()

# How tissue moves.
function(trocar_add_stepper name)
    trocar_add_method(stepper ${name} ${ARGN})
endfunction()
