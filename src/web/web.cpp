#include "web/web.hpp"

// The assembler takes each file in as it is: no generator, and no array that a compiler parses byte by byte.
// TROCAR_WEB_FOLDER comes from CMakeLists.txt, which also makes this file depend on the scripts.
#define TROCAR_EMBED(name, file)                                            \
    asm(".section .rodata\n"                                                \
        ".balign 16\n" #name                                                \
        "_begin:\n"                                                         \
        ".incbin \"" TROCAR_WEB_FOLDER "/" file "\"\n" #name                \
        "_end:\n"                                                           \
        ".byte 0\n"                                                         \
        ".previous\n");                                                     \
    extern "C" {                                                            \
    __attribute__((visibility("hidden"))) extern const char name##_begin[]; \
    __attribute__((visibility("hidden"))) extern const char name##_end[];   \
    }

TROCAR_EMBED(trocar_web_charts, "charts.js")
TROCAR_EMBED(trocar_web_viewer, "viewer.js")

namespace trocar::web {

std::string_view charts_script() {
    return {trocar_web_charts_begin, static_cast<std::size_t>(trocar_web_charts_end - trocar_web_charts_begin)};
}

std::string_view viewer_script() {
    return {trocar_web_viewer_begin, static_cast<std::size_t>(trocar_web_viewer_end - trocar_web_viewer_begin)};
}

}  // namespace trocar::web
