// The program trocar. Projects of their own compile this very file, with their methods beside it.
#include "app/program.hpp"

#ifndef TROCAR_SHARE
#define TROCAR_SHARE ""  // in a clone and installed it is found from where the program is
#endif

int main(int argc, char** argv) { return trocar::app::run_program(argc, argv, TROCAR_SHARE); }
