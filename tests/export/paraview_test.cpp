#include "export/paraview.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "export/reported_run.hpp"
#include "export/vtk_xml.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

using test::values_of;
using test::XmlElement;

XmlElement read_piece(const std::filesystem::path& file) {
    const XmlElement root = test::XmlText::read(test::read_file(file));
    EXPECT_EQ(root.tag, "VTKFile");
    EXPECT_EQ(root.attributes.at("type"), "PolyData");
    EXPECT_EQ(root.attributes.at("byte_order"), "LittleEndian");
    EXPECT_EQ(root.attributes.at("header_type"), "UInt64");
    return root.child("PolyData").child("Piece");
}

/// Counts, ranges and sizes as the format wants them.
void check_piece(const XmlElement& piece) {
    const std::size_t points = piece.count("NumberOfPoints");
    const std::size_t polys = piece.count("NumberOfPolys");
    const std::size_t verts = piece.count("NumberOfVerts");
    EXPECT_EQ(values_of<double>(piece.child("Points").named("Points")).size(), 3 * points);
    for (const auto& [tag, cells] : {std::pair{"Polys", polys}, std::pair{"Verts", verts}}) {
        const auto corners = values_of<std::int64_t>(piece.child(tag).named("connectivity"));
        const auto ends = values_of<std::int64_t>(piece.child(tag).named("offsets"));
        EXPECT_EQ(ends.size(), cells);
        EXPECT_TRUE(std::is_sorted(ends.begin(), ends.end()));
        EXPECT_EQ(ends.empty() ? 0 : ends.back(), static_cast<std::int64_t>(corners.size()));
        for (const std::int64_t corner : corners) {
            EXPECT_TRUE(corner >= 0 && corner < static_cast<std::int64_t>(points)) << corner;
        }
    }
    for (const auto& [tag, tuples] : {std::pair{"PointData", points}, std::pair{"CellData", polys + verts}}) {
        for (const XmlElement& array : piece.child(tag).inner) {
            const bool whole = array.attributes.at("type") == "Int32";
            const std::size_t count = whole ? values_of<std::int32_t>(array).size() : values_of<double>(array).size();
            EXPECT_EQ(count, tuples * array.count("NumberOfComponents")) << array.attributes.at("Name");
        }
    }
}

std::set<std::string> files_in(const std::filesystem::path& folder) {
    std::set<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        files.insert(entry.path().filename().string());
    return files;
}

TEST(Paraview, CollectionNamesEveryFileOfEveryTickWithItsTime) {
    const test::TemporaryFolder folder;
    const test::ReportedRun run(ExportFormat::paraview, folder.path(), 13);
    const XmlElement root = test::XmlText::read(test::read_file(folder.path() / "turning_poke.pvd"));
    EXPECT_EQ(root.attributes.at("type"), "Collection");
    std::set<std::string> named{"turning_poke.pvd"};
    std::map<double, int> times;
    for (const XmlElement& one : root.child("Collection").inner) {
        named.insert(one.attributes.at("file"));
        ++times[std::stod(one.attributes.at("timestep"))];
    }
    EXPECT_EQ(named, files_in(folder.path()));
    EXPECT_EQ(times, (std::map<double, int>{{0.0, 2}, {13 * 0.001, 2}, {26 * 0.001, 2}, {39 * 0.001, 2}}));
}

TEST(Paraview, FilesAreWellFormedAndCountsAndRangesAgree) {
    const test::TemporaryFolder folder;
    const test::ReportedRun run(ExportFormat::paraview, folder.path(), 13);
    std::size_t contacts = 0;
    for (const std::string& file : files_in(folder.path())) {
        if (!file.ends_with(".vtp")) continue;
        const XmlElement piece = read_piece(folder.path() / file);
        check_piece(piece);
        contacts += piece.count("NumberOfVerts");
    }
    EXPECT_GT(contacts, 0U) << "the run must touch";
}

TEST(Paraview, NumbersAreThoseThatTheSimulationReports) {
    const test::TemporaryFolder folder;
    const test::ReportedRun run(ExportFormat::paraview, folder.path(), 13);
    std::size_t forces = 0;
    for (const std::int64_t tick : {0, 13, 26, 39}) {
        const test::ReportedTick& reported = run.ticks.at(tick);
        const auto file = [&](const char* what) {
            return folder.path() / fmt::format("turning_poke_{}_{:06}.vtp", what, tick);
        };
        const XmlElement bodies = read_piece(file("bodies"));
        const auto points = values_of<double>(bodies.child("Points").named("Points"));
        EXPECT_EQ(points,
                  std::vector<double>(reported.position.data(), reported.position.data() + reported.position.size()));
        const auto path = values_of<double>(bodies.child("PointData").named("displacement"));
        const Matrix3X moved = reported.position - run.scene.first.position;
        EXPECT_EQ(path, std::vector<double>(moved.data(), moved.data() + moved.size()));
        const XmlElement contacts = read_piece(file("contacts"));
        const auto force = values_of<double>(contacts.child("PointData").named("force"));
        const auto is_reported = values_of<std::int32_t>(contacts.child("PointData").named("force_reported"));
        std::vector<Vector3> written;
        for (std::size_t i = 0; i < is_reported.size(); ++i) {
            const Vector3 one(force[3 * i], force[3 * i + 1], force[3 * i + 2]);
            if (one.norm() > 0.0) {
                EXPECT_EQ(is_reported[i], 1);
                written.push_back(one);
            }
        }
        EXPECT_EQ(written, reported.load_force);
        forces += written.size();
        const XmlElement root = test::XmlText::read(test::read_file(file("bodies")));
        const auto tool = values_of<double>(root.child("PolyData").child("FieldData").named("tool_force"));
        EXPECT_EQ(Vector3(tool[0], tool[1], tool[2]), reported.tool.force);
    }
    EXPECT_GT(forces, 0U);
}

TEST(Paraview, VtksOwnReaderReadsTheSameNumbers) {
    const std::string python = "/usr/bin/python3";  // the one that Debian's bindings are for
    if (std::system((python + " -c 'import vtkmodules.vtkIOXML' >/dev/null 2>&1").c_str()) != 0) {
        GTEST_SKIP() << "python3-vtk9 is not installed (./test.sh full installs it)";
    }
    const test::TemporaryFolder folder;
    const test::ReportedRun run(ExportFormat::paraview, folder.path(), 13);
    std::string command = python + " " + TROCAR_SOURCE_DIR + "/tests/export/read_with_vtk.py";
    std::size_t asked = 0;
    for (const std::string& file : files_in(folder.path())) {
        if (!file.ends_with(".vtp")) continue;
        command += " " + (folder.path() / file).string();
        ++asked;
    }
    const test::TemporaryFolder answer;
    ASSERT_EQ(std::system((command + " >" + (answer.path() / "out").string()).c_str()), 0);
    const nlohmann::json read = nlohmann::json::parse(test::read_file(answer.path() / "out"));
    ASSERT_EQ(read.size(), asked);
    for (const std::int64_t tick : {0, 13, 26, 39}) {
        const test::ReportedTick& reported = run.ticks.at(tick);
        const nlohmann::json& bodies =
            read.at((folder.path() / fmt::format("turning_poke_bodies_{:06}.vtp", tick)).string());
        EXPECT_EQ(bodies["points"].get<std::vector<double>>(),
                  std::vector<double>(reported.position.data(), reported.position.data() + reported.position.size()));
        const Triangles& triangles = run.scene.topology.triangles;
        ASSERT_EQ(bodies["polys"].size(), static_cast<std::size_t>(4 * triangles.cols()));
        for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
            for (int corner = 0; corner < 3; ++corner) {
                ASSERT_EQ(bodies["polys"][static_cast<std::size_t>(4 * t + 1 + corner)], triangles(corner, t));
            }
        }
        for (const char* name : {"depth", "strain", "displacement", "body"})
            EXPECT_TRUE(bodies["arrays"].contains(name));
        EXPECT_EQ(bodies["field"]["body_names"], nlohmann::json({"tool", "sheet"}));
        const nlohmann::json& contacts =
            read.at((folder.path() / fmt::format("turning_poke_contacts_{:06}.vtp", tick)).string());
        Vector3 sum = Vector3::Zero();
        const auto force = contacts["arrays"]["force"].get<std::vector<double>>();
        for (std::size_t i = 0; i < force.size(); ++i) sum[static_cast<Eigen::Index>(i % 3)] += force[i];
        Vector3 reported_sum = Vector3::Zero();
        for (const Vector3& one : reported.load_force) reported_sum += one;
        EXPECT_LT((sum - reported_sum).norm(), 1e-12);
        EXPECT_EQ(contacts["verts"], contacts["points"].size() / 3);
    }
}

TEST(Vtp, NamesOfAnyLettersAndEmptyArraysStayWellFormed) {
    VtkPolyData data;
    data.at_points = {{.name = "a<b> & \"c\"", .values = std::vector<double>{}}};
    data.field = {{.name = "names", .values = std::vector<std::string>{"x", "é"}}};
    const XmlElement root = test::XmlText::read(to_vtp(data));
    check_piece(root.child("PolyData").child("Piece"));
    EXPECT_EQ(root.child("PolyData").child("FieldData").named("names").text, "120 0 195 169 0 ");
}

}  // namespace
}  // namespace trocar
