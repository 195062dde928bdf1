#include "fuzz_target.hpp"

void trocar::fuzz::mesh_stl(std::string_view input) { read_and_report(mesh_text::read_stl, input); }
