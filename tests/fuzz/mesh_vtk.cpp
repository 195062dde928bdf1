#include "fuzz_target.hpp"

void trocar::fuzz::mesh_vtk(std::string_view input) { read_and_report(mesh_text::read_vtk, input); }
