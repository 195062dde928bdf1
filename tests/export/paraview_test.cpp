// ParaView's files as VTK's own reader reads them.
#include "export/paraview.hpp"

#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "export/reported_run.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

using nlohmann::json;

const std::string python = "/usr/bin/python3";  // the one that Debian's bindings are for

bool no_vtk() { return std::system((python + " -c 'import vtkmodules.vtkIOXML' >/dev/null 2>&1").c_str()) != 0; }
constexpr const char* missing = "python3-vtk9 is not installed (./test.sh full installs it)";

std::set<std::string> files_in(const std::filesystem::path& folder) {
    std::set<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        files.insert(entry.path().filename().string());
    return files;
}

/// What VTK reads in the .vtp files of the folder, by name; null when it refuses one.
json read_by_vtk(const std::filesystem::path& folder) {
    std::string command =
        "cd " + folder.string() + " && " + python + " " + TROCAR_SOURCE_DIR + "/tests/export/read_with_vtk.py";
    for (const std::string& file : files_in(folder)) {
        if (file.ends_with(".vtp")) command += " " + file;
    }
    const test::TemporaryFolder answer;
    const std::string out = (answer.path() / "out").string();
    return std::system((command + " >" + out).c_str()) == 0 ? json::parse(test::read_file(out)) : json();
}

std::vector<Vector3> vectors_of(const json& numbers) {
    std::vector<Vector3> vectors;
    for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
        vectors.emplace_back(numbers[i].get<double>(), numbers[i + 1].get<double>(), numbers[i + 2].get<double>());
    return vectors;
}

std::vector<Vector3> columns_of(const Matrix3X& matrix) {
    std::vector<Vector3> columns;
    for (Eigen::Index i = 0; i < matrix.cols(); ++i) columns.emplace_back(matrix.col(i));
    return columns;
}

TEST(Paraview, CollectionNamesEveryFileOfEveryTickWithItsTime) {
    const test::TemporaryFolder folder;
    const test::ReportedRun run(ExportFormat::paraview, folder.path(), 13);
    const std::string collection = test::read_file(folder.path() / "turning_poke.pvd");
    EXPECT_NE(collection.find("<VTKFile type=\"Collection\""), std::string::npos);
    const std::regex entry(R"re(<DataSet timestep="([^"]*)" [^>]*file="([^"]*)"/>)re");
    std::set<std::string> named{"turning_poke.pvd"};
    std::map<double, int> times;
    for (std::sregex_iterator one(collection.begin(), collection.end(), entry); one != std::sregex_iterator(); ++one) {
        named.insert((*one)[2]);
        ++times[std::stod((*one)[1])];
    }
    EXPECT_EQ(named, files_in(folder.path()));
    EXPECT_EQ(times, (std::map<double, int>{{0.0, 2}, {13 * 0.001, 2}, {26 * 0.001, 2}, {39 * 0.001, 2}}));
}

TEST(Paraview, NumbersAreThoseThatTheSimulationReports) {
    if (no_vtk()) GTEST_SKIP() << missing;
    const test::TemporaryFolder folder;
    const test::ReportedRun run(ExportFormat::paraview, folder.path(), 13);
    const json read = read_by_vtk(folder.path());
    ASSERT_EQ(read.size(), 8U) << read;
    std::size_t forces = 0;
    for (const std::int64_t tick : {0, 13, 26, 39}) {
        const test::ReportedTick& reported = run.ticks.at(tick);
        const json& bodies = read.at(fmt::format("turning_poke_bodies_{:06}.vtp", tick));
        EXPECT_EQ(vectors_of(bodies["points"]), columns_of(reported.position));
        EXPECT_EQ(vectors_of(bodies["arrays"]["displacement"]),
                  columns_of(reported.position - run.scene.first.position));
        const Triangles& triangles = run.scene.topology.triangles;
        ASSERT_EQ(bodies["polys"].size(), static_cast<std::size_t>(4 * triangles.cols()));
        for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
            for (int corner = 0; corner < 3; ++corner) {
                ASSERT_EQ(bodies["polys"][static_cast<std::size_t>(4 * t + 1 + corner)], triangles(corner, t));
            }
        }
        for (const char* name : {"depth", "strain", "body"}) {
            EXPECT_EQ(bodies["arrays"][name].size(), bodies["points"].size() / 3) << name;
        }
        EXPECT_EQ(bodies["cell_arrays"]["body"].size(), static_cast<std::size_t>(triangles.cols()));
        EXPECT_EQ(bodies["field"]["body_names"], json({"tool", "sheet"}));
        EXPECT_EQ(vectors_of(bodies["field"]["tool_force"]), std::vector<Vector3>{reported.tool.force});
        const json& contacts = read.at(fmt::format("turning_poke_contacts_{:06}.vtp", tick));
        EXPECT_EQ(contacts["verts"], contacts["points"].size() / 3);
        std::vector<Vector3> written = vectors_of(contacts["arrays"]["force"]);
        for (std::size_t i = 0; i < written.size(); ++i) {
            EXPECT_TRUE(written[i].isZero(0.0) || contacts["arrays"]["force_reported"][i] == 1) << i;
        }
        std::erase_if(written, [](const Vector3& force) { return force.isZero(0.0); });
        EXPECT_EQ(written, reported.load_force);
        forces += written.size();
    }
    EXPECT_GT(forces, 0U) << "the run must touch";
}

TEST(Vtp, NamesOfAnyLettersAndEmptyArraysAreRead) {
    if (no_vtk()) GTEST_SKIP() << missing;
    VtkPolyData data;
    data.at_points = {{.name = "a<b> & \"c\"", .values = std::vector<double>{}}};
    data.field = {{.name = "names", .values = std::vector<std::string>{"x", "é"}}};
    const test::TemporaryFolder folder;
    folder.write("names.vtp", to_vtp(data));
    const json read = read_by_vtk(folder.path());
    ASSERT_TRUE(read.is_object());
    EXPECT_TRUE(read.at("names.vtp").at("arrays").contains("a<b> & \"c\"")) << read;
    EXPECT_EQ(read.at("names.vtp").at("field").at("names"), json({"x", "é"}));
}

}  // namespace
}  // namespace trocar
