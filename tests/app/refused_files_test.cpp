// Files that no method ever sees: the program ends with status 2, and its one line names the place to mend.
#include <gtest/gtest.h>

#include <string>

#include "support/program.hpp"

namespace trocar {
namespace {

TEST(RefusedFiles, EndWithStatusTwoAndTheirPlace) {
    struct Refused {
        const char* command;
        const char* file;
        const char* place;  ///< behind the file's name
    };
    const std::string folder = std::string(TROCAR_SOURCE_DIR) + "/tests/app/refused/";
    for (const Refused& one : {
             Refused{"mesh", "index_out_of_range.obj", ": line 4: expected a vertex number 1 to 3, got 4\n"},
             Refused{"mesh", "nan_vertex.obj", ": line 2: expected a finite number, got 'nan'\n"},
             Refused{"run", "zero_mass.json", ": /bodies/0/tissue/density: expected a number > 0, got 0\n"},
             Refused{"run", "inside_out_body.json",
                     ": /bodies/0/parts/0/mesh: expected closed surfaces with their volume inside, triangles "
                     "counter-clockwise seen from outside, got a volume of -6e-05 m³ in the 12 triangles"},
             Refused{"run", "turned_triangle.json",
                     ": /bodies/0/parts/0/mesh: expected neighbouring triangles that run round the same way, got 3 "
                     "edges where they do not, first between triangles 5 and 8; turn round triangle 5 "},
         }) {
        const std::string file = folder + one.file;
        const test::ProgramResult result = test::run_program(std::string(one.command) + " " + file);
        EXPECT_EQ(result.status, 2) << file;
        EXPECT_EQ(result.out, "") << file;
        EXPECT_TRUE(result.err.starts_with("trocar: " + file + one.place)) << result.err;
    }
}

}  // namespace
}  // namespace trocar
