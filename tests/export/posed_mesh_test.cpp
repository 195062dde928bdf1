#include <gtest/gtest.h>

#include "export/reported_run.hpp"
#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

TEST(PosedMeshes, AreTheBodiesOfTheTickToTheBit) {
    const test::TemporaryFolder folder;
    const test::ReportedRun run(ExportFormat::obj, folder.path(), 20);
    for (const std::int64_t tick : {0, 20}) {
        for (const BodyRange& body : run.scene.topology.bodies) {
            const Mesh mesh = read_mesh(folder.path() / fmt::format("{}_{:06}.obj", body.name, tick));
            EXPECT_EQ(mesh.vertices, run.ticks.at(tick).position.middleCols(body.vertices.first, body.vertices.count));
            const Triangles own = run.scene.topology.triangles.middleCols(body.triangles.first, body.triangles.count);
            EXPECT_EQ(mesh.triangles, Triangles(own.array() - body.vertices.first));
        }
    }
}

TEST(UnfinishedFolder, IsThereAsAWholeOrNotAtAll) {
    const test::TemporaryFolder folder;
    const std::filesystem::path target = folder.path() / "out";
    {
        const UnfinishedFolder unfinished(target);
        std::ofstream(unfinished.path() / "half") << "half";
        EXPECT_FALSE(std::filesystem::exists(target));
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "what was not kept is gone";
    {
        UnfinishedFolder unfinished(target);
        std::ofstream(unfinished.path() / "whole") << "whole";
        unfinished.keep();
    }
    EXPECT_EQ(test::read_file(target / "whole"), "whole");
    EXPECT_THROW(UnfinishedFolder{target}, InputError) << "what is there is not overwritten";
    EXPECT_EQ(test::read_file(target / "whole"), "whole");
}

}  // namespace
}  // namespace trocar
