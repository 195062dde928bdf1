# Methods of trocar itself (method.cmake): an object library each, and a line in method_table.cpp.
function(trocar_join_method kind name reason files needs)
    if(reason)
        set_property(GLOBAL APPEND_STRING PROPERTY TROCAR_TABLE_BODY
            "    registry.add_absent_${kind}({\"${name}\", \"${reason}\"});\n")
        return()
    endif()
    add_library(trocar_${kind}_${name} OBJECT ${files})
    target_link_libraries(trocar_${kind}_${name} PRIVATE trocar_timed_options fmt::fmt ${needs})
    trocar_use_precompiled(trocar_${kind}_${name} trocar_folder_headers)
    set_property(GLOBAL APPEND PROPERTY TROCAR_OBJECTS trocar_${kind}_${name})
    trocar_entry_type(${kind} entry)
    set_property(GLOBAL APPEND_STRING PROPERTY TROCAR_TABLE_HEAD "${entry} ${name}_${kind}();\n")
    set_property(GLOBAL APPEND_STRING PROPERTY TROCAR_TABLE_BODY "    registry.add(${name}_${kind}());\n")
endfunction()

function(trocar_write_method_table file)
    get_property(head GLOBAL PROPERTY TROCAR_TABLE_HEAD)
    get_property(body GLOBAL PROPERTY TROCAR_TABLE_BODY)
    file(CONFIGURE OUTPUT ${file} CONTENT
"// Written by CMake from the trocar_add_detector, trocar_add_response, trocar_add_contact_generator and trocar_add_stepper lines.
#include \"method/registry.hpp\"

namespace trocar {

${head}
void register_all_methods(Registry& registry);
void register_all_methods([[maybe_unused]] Registry& registry) {
${body}}

}  // namespace trocar
" @ONLY)
endfunction()
