#include "fuzz_target.hpp"

void trocar::fuzz::mesh_ply(std::string_view input) { read_and_report(mesh_text::read_ply, input); }
