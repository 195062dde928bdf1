# How a method joins: one line, trocar_add_detector(NAME [NEEDS targets …]), trocar_add_response(…), trocar_add_source(…)
# or trocar_add_stepper(…), beside NAME.cpp.
# NAME.cpp defines, in namespace trocar, `DetectorEntry NAME_detector()` or `ResponseEntry NAME_response()`.
# The names are collected and written into method_table.cpp, so that a wrong name is a link error. A method whose
# library is missing stays visible: it is listed as absent with the reason.

function(trocar_add_method kind name)
    cmake_parse_arguments(METHOD "" "REASON" "NEEDS;SOURCES" ${ARGN})
    set(missing "")
    foreach(target ${METHOD_NEEDS})
        if(NOT TARGET ${target})
            list(APPEND missing ${target})
        endif()
    endforeach()
    if(missing OR METHOD_REASON)
        set(reason "${METHOD_REASON}")
        if(NOT reason)
            if(NOT TROCAR_FOREIGN)
                set(reason "built without foreign libraries")
            else()
                list(JOIN missing ", " missing_text)
                set(reason "library not found: ${missing_text}")
            endif()
        endif()
        set_property(GLOBAL APPEND_STRING PROPERTY TROCAR_TABLE_BODY
            "    registry.add_absent_${kind}({\"${name}\", \"${reason}\"});\n")
        message(STATUS "trocar: ${kind} ${name} absent (${reason})")
        return()
    endif()
    add_library(trocar_${kind}_${name} OBJECT ${name}.cpp ${METHOD_SOURCES})
    target_link_libraries(trocar_${kind}_${name} PRIVATE trocar_options fmt::fmt ${METHOD_NEEDS})
    set_property(GLOBAL APPEND PROPERTY TROCAR_OBJECTS trocar_${kind}_${name})
    if(kind STREQUAL "detector")
        set(entry DetectorEntry)
    elseif(kind STREQUAL "source")
        set(entry SourceEntry)
    elseif(kind STREQUAL "stepper")
        set(entry StepperEntry)
    else()
        set(entry ResponseEntry)
    endif()
    set_property(GLOBAL APPEND_STRING PROPERTY TROCAR_TABLE_HEAD "${entry} ${name}_${kind}();\n")
    set_property(GLOBAL APPEND_STRING PROPERTY TROCAR_TABLE_BODY "    registry.add(${name}_${kind}());\n")
endfunction()

function(trocar_add_detector name)
    trocar_add_method(detector ${name} ${ARGN})
endfunction()

function(trocar_add_response name)
    trocar_add_method(response ${name} ${ARGN})
endfunction()

# A contact source: `SourceEntry NAME_source()`. What it needs is always there.
function(trocar_add_source name)
    trocar_add_method(source ${name} ${ARGN})
endfunction()

# How tissue moves: `StepperEntry NAME_stepper()`.
function(trocar_add_stepper name)
    trocar_add_method(stepper ${name} ${ARGN})
endfunction()

function(trocar_write_method_table file)
    get_property(head GLOBAL PROPERTY TROCAR_TABLE_HEAD)
    get_property(body GLOBAL PROPERTY TROCAR_TABLE_BODY)
    file(CONFIGURE OUTPUT ${file} CONTENT
"// Written by CMake from the trocar_add_detector, trocar_add_response, trocar_add_source and trocar_add_stepper lines.
#include \"method/registry.hpp\"

namespace trocar {

${head}
void register_all_methods(Registry& registry);
void register_all_methods([[maybe_unused]] Registry& registry) {
${body}}

}  // namespace trocar
" @ONLY)
endfunction()
