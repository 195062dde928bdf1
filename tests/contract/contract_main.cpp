// The contract tests of a project of its own, which compiles this file with its methods beside it (src/outside.cmake).
#include "contract/contract_program.hpp"

#ifndef TROCAR_KNOWN_GAPS
#define TROCAR_KNOWN_GAPS ""
#endif

int main(int argc, char** argv) {
    return trocar::test::run_contract_tests(argc, argv, TROCAR_SHARE, TROCAR_KNOWN_GAPS);
}
