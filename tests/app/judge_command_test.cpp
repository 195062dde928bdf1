// Frames of another simulator: the same ones in every format against the same analytic depths, written here from the
// formats' descriptions and by NumPy and VTK themselves; passages, sides, limits and refusals.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>

#include "scene/recording.hpp"
#include "support/commands.hpp"
#include "support/meshes.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using Json = nlohmann::json;
using test::Faces;
using test::Shape;
using Frames = std::vector<std::vector<Vector3>>;

/// A ball of eight faces, in mm, with a vertex at its lowest point.
Shape ball(double radius) {
    Shape shape;
    for (const double side : {-radius, radius}) {
        shape.vertices.emplace_back(side, 0, 0);
        shape.vertices.emplace_back(0, side, 0);
        shape.vertices.emplace_back(0, 0, side);
    }
    for (const Index x : {0, 3}) {
        for (const Index y : {1, 4}) {
            for (const Index z : {2, 5}) {
                const bool turned = ((x == 0) != (y == 1)) != (z == 2);
                shape.triangles.push_back(turned ? std::array<Index, 3>{x, z, y} : std::array<Index, 3>{x, y, z});
            }
        }
    }
    return shape;
}

/// A plate that is flat and square, its upper face in z = 0, in mm.
Shape plate(double half, double thickness) {
    Shape shape;
    for (const double z : {-thickness, 0.0}) {
        shape.vertices.insert(shape.vertices.end(),
                              {{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}});
    }
    shape.triangles = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}};
    for (Index i = 0; i < 4; ++i) {
        const Index next = (i + 1) % 4;
        shape.triangles.push_back({i, next, next + 4});
        shape.triangles.push_back({i, next + 4, i + 4});
    }
    return shape;
}

/// A square sheet of n × n points about the origin, in mm, its front up.
Shape sheet(Index n, double size) {
    Shape shape;
    for (Index j = 0; j < n; ++j) {
        for (Index i = 0; i < n; ++i)
            shape.vertices.emplace_back(size * i / (n - 1) - size / 2, size * j / (n - 1) - size / 2, 0);
    }
    for (Index j = 0; j + 1 < n; ++j) {
        for (Index i = 0; i + 1 < n; ++i) {
            const Index a = j * n + i;
            shape.triangles.push_back({a, a + 1, a + n + 1});
            shape.triangles.push_back({a, a + n + 1, a + n});
        }
    }
    return shape;
}

const std::vector<double> depths{-1.0, 0.5, 1.25, 2.0, 0.25, -0.5};  // mm

/// The ball sinks into the plate, by what `depths` says.
struct Sinking {
    Sinking() {
        Shape first = ball(10.0);
        ball_triangles = first.triangles.size();
        ball_vertices = first.vertices.size();
        faces = first.add(plate(50.0, 20.0)).triangles;
        for (const double depth : depths) {
            Shape frame = ball(10.0).move({0, 0, 10.0 - depth});
            frames.push_back(frame.add(plate(50.0, 20.0)).vertices);
        }
    }
    Frames frames;
    Faces faces;
    std::size_t ball_triangles = 0;
    std::size_t ball_vertices = 0;
};

// ---- writers, by the descriptions of the formats ----

std::string lines_of(const std::vector<Vector3>& points, const char* before = "") {
    std::string text;
    for (const Vector3& p : points) text += fmt::format("{}{} {} {}\n", before, p.x(), p.y(), p.z());
    return text;
}

std::string obj(const std::vector<Vector3>& points, const Faces& faces, std::size_t second_from,
                const char* word = "o") {
    std::string text = fmt::format("{} ball\n{}", word, lines_of(points, "v "));
    for (std::size_t t = 0; t < faces.size(); ++t) {
        if (t == second_from) text += fmt::format("{} plate\n", word);
        text += fmt::format("f {} {} {}\n", faces[t][0] + 1, faces[t][1] + 1, faces[t][2] + 1);
    }
    return text;
}

std::string counted_faces(const Faces& faces) {
    std::string text;
    for (const auto& [a, b, c] : faces) text += fmt::format("3 {} {} {}\n", a, b, c);
    return text;
}

std::string off(const std::vector<Vector3>& points, const Faces& faces) {
    return fmt::format("OFF\n{} {} 0\n", points.size(), faces.size()) + lines_of(points) + counted_faces(faces);
}

std::string ply(const std::vector<Vector3>& points, const Faces& faces) {
    return fmt::format(
               "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
               "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
               points.size(), faces.size()) +
           lines_of(points) + counted_faces(faces);
}

std::string stl(const std::vector<Vector3>& points, const Faces& faces) {
    std::string text = "solid frame\n";
    for (const std::array<Index, 3>& face : faces) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (const Index corner : face) text += lines_of({points[at(corner)]}, "vertex ");
        text += "endloop\nendfacet\n";
    }
    return text + "endsolid frame\n";
}

std::string vtk(const std::vector<Vector3>& points, const Faces& faces) {
    return fmt::format("# vtk DataFile Version 3.0\na title\nASCII\nDATASET POLYDATA\nPOINTS {} double\n",
                       points.size()) +
           lines_of(points) + fmt::format("POLYGONS {} {}\n", faces.size(), 4 * faces.size()) + counted_faces(faces);
}

template <typename Number>
std::string bytes_of(Number number, bool big_endian) {
    const auto raw = std::bit_cast<std::array<char, sizeof(Number)>>(number);
    std::string bytes(raw.begin(), raw.end());
    if (big_endian) std::reverse(bytes.begin(), bytes.end());
    return bytes;
}

std::string reals_of(const std::vector<Vector3>& points, bool big_endian) {
    std::string bytes;
    for (const Vector3& p : points) {
        for (int axis = 0; axis < 3; ++axis) bytes += bytes_of(p[axis], big_endian);
    }
    return bytes;
}

std::string binary_vtk(const std::vector<Vector3>& points, const Faces& faces) {
    std::string text =
        fmt::format("# vtk DataFile Version 3.0\na title\nBINARY\nDATASET POLYDATA\nPOINTS {} double\n", points.size());
    text += reals_of(points, true) + fmt::format("\nPOLYGONS {} {}\n", faces.size(), 4 * faces.size());
    for (const std::array<Index, 3>& face : faces) {
        text += bytes_of(std::int32_t{3}, true);
        for (const Index corner : face) text += bytes_of(corner, true);
    }
    return text + "\n";
}

/// Raw appended data behind 32-bit lengths.
std::string vtp(const std::vector<Vector3>& points, const Faces& faces) {
    std::string connected;
    std::string ends;
    for (std::size_t t = 0; t < faces.size(); ++t) {
        for (const Index corner : faces[t]) connected += bytes_of(std::int64_t{corner}, false);
        ends += bytes_of(static_cast<std::int64_t>(3 * t + 3), false);
    }
    std::string data;
    std::vector<std::size_t> offsets;
    for (const std::string& array : {reals_of(points, false), connected, ends}) {
        offsets.push_back(data.size());
        data += bytes_of(static_cast<std::uint32_t>(array.size()), false) + array;
    }
    return fmt::format(
               "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
               "<PolyData><Piece NumberOfPoints=\"{}\" NumberOfPolys=\"{}\">\n<Points><DataArray type=\"Float64\" "
               "NumberOfComponents=\"3\" format=\"appended\" offset=\"{}\"/></Points>\n<Polys><DataArray "
               "type=\"Int64\" "
               "Name=\"connectivity\" format=\"appended\" offset=\"{}\"/>\n<DataArray type=\"Int64\" Name=\"offsets\" "
               "format=\"appended\" offset=\"{}\"/></Polys>\n</Piece></PolyData>\n<AppendedData encoding=\"raw\">_",
               points.size(), faces.size(), offsets[0], offsets[1], offsets[2]) +
           data + "</AppendedData></VTKFile>\n";
}

/// An .npy array of version 1.
std::string npy(const std::string& type, const std::string& shape, const std::string& data) {
    std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, shape);
    while ((10 + header.size() + 1) % 64 != 0) header += ' ';
    header += '\n';
    return std::string("\x93NUMPY\x01", 7) + '\0' + bytes_of(static_cast<std::uint16_t>(header.size()), false) +
           header + data;
}

/// CRC-32 (ISO 3309), bit by bit.
std::uint32_t checksum(const std::string& data) {
    std::uint32_t sum = 0xFFFFFFFFU;
    for (const char byte : data) {
        sum ^= static_cast<unsigned char>(byte);
        for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1U) ^ ((sum & 1U) != 0 ? 0xEDB88320U : 0U);
    }
    return ~sum;
}

/// A zip archive of stored members.
std::string zip(const std::vector<std::pair<std::string, std::string>>& members) {
    std::string files;
    std::string list;
    for (const auto& [name, data] : members) {
        const auto u16 = [](std::size_t number) { return bytes_of(static_cast<std::uint16_t>(number), false); };
        const auto u32 = [](std::size_t number) { return bytes_of(static_cast<std::uint32_t>(number), false); };
        const std::string common = u16(20) + u16(0) + u16(0) + u32(0) + u32(checksum(data)) + u32(data.size()) +
                                   u32(data.size()) + u16(name.size()) + u16(0);
        list += "PK\1\2" + u16(20) + common + u16(0) + u16(0) + u16(0) + u32(0) + u32(files.size()) + name;
        files += "PK\3\4" + common + name + data;
    }
    const auto count = bytes_of(static_cast<std::uint16_t>(members.size()), false);
    return files + list + "PK\5\6" + std::string(4, '\0') + count + count +
           bytes_of(static_cast<std::uint32_t>(list.size()), false) +
           bytes_of(static_cast<std::uint32_t>(files.size()), false) + std::string(2, '\0');
}

std::string npz(const Frames& frames, const Faces& faces, const std::vector<std::int32_t>& body_ids) {
    std::string positions;
    for (const std::vector<Vector3>& points : frames) positions += reals_of(points, false);
    std::string corners;
    for (const std::array<Index, 3>& face : faces) {
        for (const Index corner : face) corners += bytes_of(corner, false);
    }
    std::string ids;
    for (const std::int32_t id : body_ids) ids += bytes_of(id, false);
    return zip(
        {{"positions.npy", npy("<f8", fmt::format("{}, {}, 3", frames.size(), frames.front().size()), positions)},
         {"faces.npy", npy("<i4", fmt::format("{}, 3", faces.size()), corners)},
         {"body_ids.npy", npy("<i4", fmt::format("{},", body_ids.size()), ids)}});
}

class JudgeCommand : public testing::Test {
protected:
    using Writer = std::function<std::string(const std::vector<Vector3>&, const Faces&)>;
    /// A folder of files frame_00.EXTENSION and so on.
    std::string write_series(const std::string& name, const std::string& extension, const Frames& frames,
                             const Faces& faces, const Writer& writer) {
        std::filesystem::create_directory(folder.path() / name);
        for (std::size_t i = 0; i < frames.size(); ++i) {
            folder.write(fmt::format("{}/frame_{:02}.{}", name, i, extension), writer(frames[i], faces));
        }
        return (folder.path() / name).string();
    }
    std::string write_offs(const std::string& name, const Frames& frames, const Faces& faces) {
        return write_series(name, "off", frames, faces, off);
    }
    [[nodiscard]] std::string path(const std::string& name) const { return (folder.path() / name).string(); }
    test::TemporaryFolder folder;
};

void expect_depths(const Json& judged, const std::string& what) {
    ASSERT_EQ(judged.at("rows").size(), depths.size()) << what;
    for (std::size_t i = 0; i < depths.size(); ++i) {
        const Json& row = judged.at("rows")[i];
        EXPECT_NEAR(row.at("residual_penetration").get<double>(), 1e-3 * std::max(0.0, depths[i]), 1e-9) << what << i;
        EXPECT_EQ(row.at("wrong_side_vertices"), depths[i] > 0.0 ? 1 : 0) << what << i;
        EXPECT_EQ(row.at("true_pairs").get<int>() > 0, depths[i] > 0.0) << what << i;
        EXPECT_NEAR(row.at("time").get<double>(), 0.01 * static_cast<double>(i), 1e-12);
    }
    EXPECT_EQ(judged.at("worst_frame"), 3) << what;
    EXPECT_EQ(judged.at("summary").at("passed_through"), 0.0) << what;
    EXPECT_TRUE(judged.at("summary").at("force_max_n").is_null()) << "no frame has a force";
    for (const Json& body : judged.at("bodies")) EXPECT_EQ(body.at("closed"), true) << what;
}

TEST_F(JudgeCommand, EveryFormatGivesTheDepthsThatTheBallWasGiven) {
    const Sinking scene;
    const auto with_objects = [&](const char* word) {
        return [&scene, word](const auto& points, const Faces& faces) {
            return obj(points, faces, scene.ball_triangles, word);
        };
    };
    const std::vector<std::pair<std::string, Writer>> writers{
        {"obj", with_objects("o")}, {"off", off}, {"ply", ply}, {"stl", stl}, {"vtk", vtk}, {"vtp", vtp}};
    for (const auto& [extension, writer] : writers) {
        const std::string series = write_series(extension, extension, scene.frames, scene.faces, writer);
        expect_depths(test::json_of("judge " + series + " --unit mm --frame-time 10ms --bodies components --json"),
                      extension);
    }
    const std::string binary = write_series("binary", "vtk", scene.frames, scene.faces, binary_vtk);
    expect_depths(test::json_of("judge " + binary + " --unit mm --frame-time 10ms --bodies components --json"),
                  "binary");
    const std::string groups = write_series("groups", "obj", scene.frames, scene.faces, with_objects("g"));
    for (const std::string& objects : {path("obj"), groups}) {
        const Json judged = test::json_of("judge " + objects + " --unit mm --frame-time 10ms --bodies objects --json");
        expect_depths(judged, objects);
        EXPECT_TRUE(judged.at("bodies")[0].at("name").get<std::string>().ends_with(" ball"));
        EXPECT_EQ(judged.at("bodies")[1].at("triangles"), 12);
    }
    std::vector<std::int32_t> of_vertex(scene.frames.front().size(), -7);
    std::fill_n(of_vertex.begin(), scene.ball_vertices, 40);
    std::vector<std::int32_t> of_face(scene.faces.size(), 1);
    std::fill_n(of_face.begin(), scene.ball_triangles, 0);
    for (const auto& ids : {of_vertex, of_face}) {
        const std::string archive = folder.write("frames.npz", npz(scene.frames, scene.faces, ids)).string();
        expect_depths(test::json_of("judge " + archive + " --unit mm --frame-time 10ms --json"), "npz");
    }
}

TEST_F(JudgeCommand, SeveralInputsAndFoldersPerFrameAndListsAreTheSameFrames) {
    const Sinking scene;
    Frames balls;
    for (const std::vector<Vector3>& frame : scene.frames) {
        balls.emplace_back(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(scene.ball_vertices));
    }
    const Faces faces = ball(10.0).triangles;
    const Shape still = plate(50.0, 20.0);
    const std::string moving = write_offs("moving", balls, faces);
    const std::string standing = folder.write("standing.off", off(still.vertices, still.triangles)).string();
    const Json both = test::json_of("judge " + moving + " " + standing + " --unit mm --frame-time 10ms --json");
    expect_depths(both, "two inputs");
    // Two meshes alone are one frame.
    const Json alone = test::json_of("judge " + moving + "/frame_03.off " + standing + " --unit mm --json");
    EXPECT_EQ(alone.at("rows").size(), 1U);
    EXPECT_NEAR(alone.at("rows")[0].at("residual_penetration").get<double>(), 2e-3, 1e-9);
    EXPECT_EQ(both.at("bodies")[1].at("kind"), "rigid");
    // A folder per frame, in steps of ten; the plate in a file of its own.
    for (std::size_t i = 0; i < balls.size(); ++i) {
        const std::string frame = fmt::format("nested/step{}", 10 * i);
        std::filesystem::create_directories(folder.path() / frame);
        folder.write(frame + "/ball.off", off(balls[i], faces));
        folder.write(frame + "/plate.off", off(still.vertices, still.triangles));
    }
    expect_depths(test::json_of("judge " + path("nested") + " --unit mm --frame-time 10ms --json"), "nested");
    // ParaView's lists, with a part that has no triangle.
    std::string series = R"({"file-series-version":"1.0","files":[)";
    std::string collection = "<VTKFile type=\"Collection\"><Collection>\n";
    write_series("vtp", "vtp", scene.frames, scene.faces, vtp);
    folder.write("points.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n0 0 0\n");
    for (std::size_t i = 0; i < balls.size(); ++i) {
        const std::string name = fmt::format("vtp/frame_{:02}.vtp", i);
        series += fmt::format("{}{{\"name\":\"{}\",\"time\":{}}}", i > 0 ? "," : "", name, i);
        collection += fmt::format(
            "<DataSet timestep=\"{0}\" part=\"0\" file=\"{1}\"/>\n<DataSet timestep=\"{0}\" part=\"1\" "
            "file=\"points.vtk\"/>\n",
            i, name);
    }
    folder.write("list.vtp.series", series + "]}");
    folder.write("list.pvd", collection + "</Collection></VTKFile>");
    for (const char* list : {"list.vtp.series", "list.pvd"}) {
        expect_depths(test::json_of("judge " + path(list) + " --unit mm --frame-time 10ms --bodies components --json"),
                      list);
    }
}

TEST_F(JudgeCommand, FramesWrittenByNumpyAndByVtkGiveTheSame) {
    const std::string python = "/usr/bin/python3";  // the one that Debian's bindings are for
    if (std::system((python + " -c 'import numpy, vtkmodules.vtkIOXML' >/dev/null 2>&1").c_str()) != 0) {
        GTEST_SKIP() << "python3-numpy and python3-vtk9 are not installed";
    }
    const Sinking scene;
    write_offs("off", scene.frames, scene.faces);
    const std::string script = std::string(TROCAR_SOURCE_DIR) + "/tests/app/write_frames.py";
    ASSERT_EQ(std::system((python + " " + script + " " + path("off") + " " + path("written")).c_str()), 0);
    int formats = 0;
    for (const auto& entry : std::filesystem::directory_iterator(path("written"))) {
        expect_depths(
            test::json_of("judge " + entry.path().string() + " --unit mm --frame-time 10ms --bodies components --json"),
            entry.path().filename().string());
        ++formats;
    }
    EXPECT_GE(formats, 12);
}

TEST_F(JudgeCommand, ABodyThatJumpsThroughAnotherIsCountedWhateverItsOwnShape) {
    const Shape thin = plate(50.0, 1.0);
    const std::string standing = folder.write("plate.off", off(thin.vertices, thin.triangles)).string();
    Frames frames;
    // Above, below in one step, and above again; changing its shape all the time.
    for (const double height : {30.0, 20.0, -20.0, -30.0, 20.0}) {
        frames.push_back(ball(10.0).scale(1.0 + 0.001 * height).move({1, 2, height}).vertices);
    }
    const std::string moving = write_offs("moving", frames, ball(10.0).triangles);
    const Json judged = test::json_of("judge " + moving + " " + standing + " --unit mm --json");
    std::vector<int> passed;
    for (const Json& row : judged.at("rows")) {
        passed.push_back(row.at("passed_through").get<int>());
        EXPECT_EQ(row.at("residual_penetration"), 0.0) << "no frame shows it";
        EXPECT_TRUE(row.at("time").is_null());
    }
    EXPECT_EQ(passed, (std::vector<int>{0, 0, 1, 0, 1}));
    // Both change their shape.
    Frames soft;
    for (const double height : {30.0, 20.0, -20.0}) {
        Shape both = ball(10.0).scale(1.0 + 0.001 * height).move({1, 2, height});
        soft.push_back(both.add(plate(50.0 + 0.01 * height, 1.0)).vertices);
    }
    const std::string deforming = write_offs("soft", soft, Shape(ball(10.0)).add(thin).triangles);
    const Json both = test::json_of("judge " + deforming + " --unit mm --bodies components --json");
    EXPECT_EQ(both.at("rows")[1].at("passed_through"), 0);
    EXPECT_EQ(both.at("rows")[2].at("passed_through"), 1);
    EXPECT_EQ(test::run_program("judge " + deforming + " --unit mm --bodies components --max-passed-through 0").status,
              1);
}

TEST_F(JudgeCommand, SidesOfAnOpenSheetAreKnownFromACleanStartAlone) {
    const Shape cloth = sheet(21, 100.0);
    const std::string standing = folder.write("cloth.off", off(cloth.vertices, cloth.triangles)).string();
    Frames frames;
    for (const double height : {20.0, 9.0, -30.0}) frames.push_back(ball(10.0).move({0.3, 0.2, height}).vertices);
    const std::string moving = write_offs("moving", frames, ball(10.0).triangles);
    const std::string words = "judge " + moving + " " + standing + " --unit mm --json";
    const Json clean = test::json_of(words + " --start clean");
    EXPECT_EQ(clean.at("rows")[0].at("wrong_side"), 0);
    EXPECT_NEAR(clean.at("rows")[1].at("residual_penetration").get<double>(), 1e-3, 1e-9);
    EXPECT_EQ(clean.at("rows")[2].at("wrong_side_vertices"), 6) << "the whole ball is beyond";
    EXPECT_NEAR(clean.at("rows")[2].at("residual_penetration").get<double>(), 40e-3, 1e-9);
    EXPECT_EQ(clean.at("rows")[2].at("passed_through"), 1);
    const Json unknown = test::json_of(words);
    for (const Json& row : unknown.at("rows")) {
        EXPECT_TRUE(row.at("wrong_side").is_null());
        EXPECT_TRUE(row.at("wrong_side_area").is_null());
        EXPECT_GT(row.at("side_undecided").get<int>(), 0);
    }
    // What of the sheet lies in the ball is known all the same: the highest vertices lie less than 1 mm deep there.
    const double depth = unknown.at("rows")[1].at("residual_penetration").get<double>();
    EXPECT_GT(depth, 0.0);
    EXPECT_LT(depth, 1e-3);
    EXPECT_EQ(unknown.at("rows")[2].at("residual_penetration"), 0.0);
    test::expect_holds(test::run_program(words).err, {"n/a", "--start clean"});
    // A claim that the first frame refutes.
    const std::string crossing = write_offs("crossing", {frames[1]}, ball(10.0).triangles);
    test::expect_refused("judge " + crossing + " " + standing + " --unit mm --start clean", "frame 0");
}

TEST_F(JudgeCommand, ASingleBodyIsJudgedForItselfWhenAsked) {
    Shape cloth = sheet(5, 100.0);
    Frames frames{cloth.vertices, cloth.vertices};
    // A corner is folded over, down through the sheet.
    frames[1].front() = {10.0, 10.0, 10.0};
    frames[1][1] = {5.0, 20.0, -8.0};
    const std::string series = write_offs("cloth", frames, cloth.triangles);
    test::expect_refused("judge " + series + " --unit mm", "--self");
    const Json judged = test::json_of("judge " + series + " --unit mm --self --json");
    const Json alone = test::json_of("mesh " + series + "/frame_01.off --json");
    EXPECT_EQ(judged.at("rows")[0].at("self_intersections"), 0);
    EXPECT_GT(judged.at("rows")[1].at("self_intersections").get<int>(), 0);
    EXPECT_EQ(judged.at("rows")[1].at("self_intersections"), alone.at("self_intersections"));
    EXPECT_TRUE(judged.at("rows")[1].at("true_pairs").is_null());
    EXPECT_TRUE(judged.at("summary").at("residual_penetration_max_m").is_null());
    EXPECT_EQ(test::run_program("judge " + series + " --unit mm --self --max-self-intersections 0").status, 1);
}

TEST_F(JudgeCommand, LimitsDecideTheStatusAndTheJUnitFile) {
    const Sinking scene;
    const std::string words = "judge " + write_offs("f", scene.frames, scene.faces) +
                              " --unit mm --bodies components --junit " + path("j.xml");
    EXPECT_EQ(test::run_program(words + " --max-penetration 2.1mm --max-passed-through 0").status, 0);
    test::expect_holds(test::read_file(path("j.xml")), {"tests=\"2\" failures=\"0\"", "frame 3"});
    EXPECT_EQ(test::run_program(words + " --max-penetration 0.0019m --max-wrong-side 100000").status, 1);
    test::expect_holds(test::read_file(path("j.xml")),
                       {"tests=\"2\" failures=\"1\"", "2 mm, at most 1.9 mm", "<failure"});
    const std::string output = path("output");
    test::run_successfully(words + " --output " + output);
    expect_depths(Json::parse(test::read_file(output + "/frames.json")).is_object()
                      ? test::json_of(words + " --frame-time 10ms --json")
                      : Json(),
                  "output");
    test::expect_holds(test::read_file(output + "/worst_frame.svg"), {"<svg", "2.00 mm deep"});
    test::expect_holds(test::read_file(output + "/replay.html"), {"<html", "unknown times"});
    test::expect_refused(words + " --output " + output, "output");
}

TEST_F(JudgeCommand, ARecordingGivesTheSameFiguresAsReplay) {
    const Sinking scene;
    const Shape first = ball(10.0);
    const Shape second = plate(50.0, 20.0);
    const auto count = [](const Shape& shape) { return static_cast<Index>(shape.vertices.size()); };
    const Topology topology = make_topology({{.name = "ball",
                                              .kind = BodyKind::tissue,
                                              .vertex_count = count(first),
                                              .triangles = test::matrix_of(first.triangles)},
                                             {.name = "plate",
                                              .kind = BodyKind::rigid,
                                              .vertex_count = count(second),
                                              .triangles = test::matrix_of(second.triangles)}});
    RecordingWriter writer(path("f.trocrec"), topology, 0.01);
    for (const std::vector<Vector3>& points : scene.frames) {
        Frame frame;
        frame.position = 1e-3 * test::matrix_of(points);
        writer.write(frame);
    }
    writer.finish();
    const Json judged = test::json_of("judge " + path("f.trocrec") + " --json");
    expect_depths(judged, "recording");
    const Json replayed = test::json_of("replay " + path("f.trocrec") + " --truth --json");
    EXPECT_EQ(replayed.at("figures"), judged.at("rows"));
    for (std::size_t i = 0; i < depths.size(); ++i)
        EXPECT_EQ(replayed.at("truth")[i], judged.at("rows")[i].at("true_pairs"));
    test::expect_refused("judge " + path("f.trocrec") + " --unit mm", "--unit");
}

TEST_F(JudgeCommand, BadFramesAreRefusedInOneLineAndLeaveNothing) {
    const Sinking scene;
    const std::string words = " --unit mm --bodies components --output " + path("out") + " --junit " + path("out.xml");
    const auto refuse = [&](const std::string& input, const std::string& part) {
        const std::string line = test::expect_refused("judge " + input + words, part);
        EXPECT_FALSE(std::filesystem::exists(path("out"))) << line;
        EXPECT_FALSE(std::filesystem::exists(path("out.xml"))) << line;
        for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
            EXPECT_EQ(entry.path().filename().string().find("out"), std::string::npos) << entry.path();
        }
    };
    const std::string whole = write_offs("whole", scene.frames, scene.faces);
    test::expect_refused("judge " + whole, "--unit");
    test::expect_refused("judge " + whole + " --unit mm --frame-time 10", "--frame-time");
    test::expect_refused("judge " + whole + " --unit mm --max-penetration 0.5", "--max-penetration");
    test::expect_refused("judge " + whole + " --unit mm --bodies objects", "object (o)");
    test::expect_refused("judge " + whole + " --unit mm", "two bodies");
    refuse(path("nowhere"), "no such file");

    const std::string gap = write_offs("gap", scene.frames, scene.faces);
    std::filesystem::remove(gap + "/frame_02.off");
    refuse(gap, "frame_01.off: expected frame 2 after it, in steps of 1, got frame 3");

    Faces fewer = scene.faces;
    fewer.pop_back();
    const std::string changed = write_offs("changed", scene.frames, scene.faces);
    folder.write("changed/frame_03.off", off(scene.frames[3], fewer));
    refuse(changed, "frame_03.off: expected 14 vertices and 20 triangles, as frame_00.off has, got 14 and 19");
    Faces turned = scene.faces;
    std::swap(turned[4][0], turned[4][1]);
    folder.write("changed/frame_03.off", off(scene.frames[3], turned));
    refuse(changed, "frame_03.off: triangle 4");

    const std::string mixed = write_offs("mixed", scene.frames, scene.faces);
    folder.write("mixed/frame_00.ply", ply(scene.frames[0], scene.faces));
    refuse(mixed, "one format");
    folder.write("mixed/frame_00.ply", "");
    std::filesystem::remove(mixed + "/frame_00.ply");
    folder.write("mixed/floor.off", off(scene.frames[0], scene.faces));
    refuse(mixed, "floor.off: expected a name with the number of its frame");
    std::filesystem::create_directory(path("empty"));
    refuse(path("empty"), "none");

    std::vector<std::int32_t> ids(scene.faces.size(), 1);
    const std::string archive = npz(scene.frames, scene.faces, ids);
    for (const std::size_t bytes : {std::size_t{1}, std::size_t{100}, archive.size() / 2, archive.size() - 1}) {
        refuse(folder.write("cut.npz", archive.substr(0, bytes)).string(), "whole .npz");
    }
    std::string flipped = archive;
    flipped[archive.find("faces.npy") - 100] ^= 1;  // the lowest bit of a position of the last frame
    refuse(folder.write("flipped.npz", flipped).string(), "array 'positions': expected bytes of the checksum");
    Frames infinite = scene.frames;
    infinite[4][9].y() = std::numeric_limits<double>::infinity();
    refuse(folder.write("inf.npz", npz(infinite, scene.faces, ids)).string(),
           "inf.npz: frame 4: vertex 9: expected finite");
    Faces beyond = scene.faces;
    beyond[3][2] = 14;
    refuse(folder.write("beyond.npz", npz(scene.frames, beyond, ids)).string(),
           "array 'faces': expected numbers 0 to 13, got 14");
    ids.pop_back();
    refuse(folder.write("ids.npz", npz(scene.frames, scene.faces, ids)).string(), "body_ids");
    refuse(folder.write("no.npz", zip({{"verts.npy", npy("<f8", "1, 1, 3", std::string(24, '\0'))}})).string(),
           "expected an array 'positions', got verts");
    refuse(folder.write("object.npz", zip({{"positions.npy", npy("|O", "1, 1, 3", "")}})).string(),
           "float32, float64 or integers");
    refuse(folder.write("short.npz", zip({{"positions.npy", npy("<f8", "9, 1, 3", std::string(24, '\0'))}})).string(),
           "as the shape needs");

    refuse(folder.write("g.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_GRID\n").string(),
           "POLYDATA");
    const std::string binary = binary_vtk(scene.frames[0], scene.faces);
    refuse(folder.write("cut.vtk", binary.substr(0, binary.size() / 2)).string(), "cut.vtk: byte");
    const std::string xml = vtp(scene.frames[0], scene.faces);
    refuse(folder.write("cut.vtp", xml.substr(0, xml.size() - 100)).string(), "cut.vtp: byte");
}

}  // namespace
}  // namespace trocar
