#include "fuzz_target.hpp"

void trocar::fuzz::mesh_vtp(std::string_view input) { read_and_report(mesh_text::read_vtp, input); }
