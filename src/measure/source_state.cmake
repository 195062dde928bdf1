# Run at every build: writes which commit the sources are at and whether they differ from it. The published reports are
# left out of the question, since publishing a report must not make the sources dirty. The file is rewritten only when
# it changes, so that nothing is compiled in vain.
execute_process(COMMAND git rev-parse HEAD WORKING_DIRECTORY ${SOURCE}
    OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
set(dirty unknown)
if(failed OR NOT EXISTS ${SOURCE}/.git)
    set(commit unknown)
else()
    execute_process(COMMAND git status --porcelain -- . ":(exclude)reports" WORKING_DIRECTORY ${SOURCE}
        OUTPUT_VARIABLE changes OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
    if(NOT failed)
        set(dirty no)
        if(changes)
            set(dirty yes)
        endif()
    endif()
endif()
set(text "// Written at every build.
#pragma once

namespace trocar::source_state {
inline constexpr const char* commit = \"${commit}\";
inline constexpr const char* dirty = \"${dirty}\";
}  // namespace trocar::source_state
")
set(old "")
if(EXISTS ${OUTPUT})
    file(READ ${OUTPUT} old)
endif()
if(NOT old STREQUAL text)
    file(WRITE ${OUTPUT} "${text}")
endif()
