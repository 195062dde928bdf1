// Every format with good and with bad small files, written by the test itself. What a good file holds is known by hand.
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "support/program.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using Corners3 = std::vector<std::array<Index, 3>>;

class MeshRead : public testing::Test {
protected:
    Mesh read(const std::string& name, const std::string& bytes) { return read_mesh(folder_.write(name, bytes)); }
    /// Message of the InputError, "" when there is none.
    std::string refusal(const std::string& name, const std::string& bytes) {
        return test::complaint_of([&] { read(name, bytes); });
    }
    /// Every message is one line that names the file and holds what is expected here.
    void expect_refused(const std::string& name, const std::string& bytes, const std::string& part) {
        const std::string message = refusal(name, bytes);
        EXPECT_NE(message.find(part), std::string::npos)
            << name << ": '" << message << "' should hold '" << part << "'";
        EXPECT_NE(message.find(name + ": "), std::string::npos) << message;
        EXPECT_NE(message.find("expected "), std::string::npos) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
    test::TemporaryFolder folder_;
};

Corners3 corners(const Mesh& mesh) {
    Corners3 list;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
        list.push_back({mesh.triangles(0, t), mesh.triangles(1, t), mesh.triangles(2, t)});
    }
    return list;
}

void put_u32(std::string& bytes, std::uint32_t value, bool big = false) {
    for (unsigned i = 0; i < 4; ++i) bytes.push_back(static_cast<char>(value >> (8 * (big ? 3 - i : i)) & 0xffU));
}

void put_u64(std::string& bytes, std::uint64_t value, bool big) {
    for (unsigned i = 0; i < 8; ++i) bytes.push_back(static_cast<char>(value >> (8 * (big ? 7 - i : i)) & 0xffU));
}

std::string binary_stl(const std::vector<std::array<float, 9>>& facets, const std::string& header = "made by a test") {
    std::string bytes = header;
    bytes.resize(80, ' ');
    put_u32(bytes, static_cast<std::uint32_t>(facets.size()));
    for (const auto& facet : facets) {
        for (int i = 0; i < 3; ++i) put_u32(bytes, 0);
        for (const float number : facet) put_u32(bytes, std::bit_cast<std::uint32_t>(number));
        bytes.append(2, '\0');
    }
    return bytes;
}

const std::vector<std::array<float, 9>> two_facets{{0, 0, 0, 1, 0, 0, 0, 1, 0}, {1, 0, 0, 1, 1, 0, 0, 1, 0}};
const std::string text_facet =
    "facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n vertex 0 1 0\n endloop\nendfacet\n";

// ---- OBJ ------------------------------------------------------------------------------------------------------------

TEST_F(MeshRead, ObjTakesEveryFormOfACornerAndSplitsPolygonsAsFans) {
    const Mesh mesh = read("a.obj",
                           "# comment\r\nmtllib x.mtl\r\no thing\r\n"
                           "v 0 0 0\r\nv +1 0 0 1.0\nv 1 1e0 0 0.5 0.5 0.5\nv 0 1 .0\nv 0.5 2. 0\n"
                           "vt 0 0\nvn 0 0 1\ns off\ng a b\nusemtl m\n"
                           "f 1/1/1 2//1 3/1 4 5\n"
                           "f -5 -4 \\\n -3\n"
                           "l 1 2\np 1\n"
                           "f 1 1 2");
    EXPECT_EQ(mesh.format, "obj");
    EXPECT_EQ(mesh.vertices_stored, 5);
    EXPECT_EQ(mesh.vertices.col(4), Vector3(0.5, 2, 0));
    EXPECT_EQ(corners(mesh), (Corners3{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 1, 2}, {0, 0, 1}}));
}

TEST_F(MeshRead, ObjFacesMayComeBeforeTheirVertices) {
    EXPECT_EQ(corners(read("a.obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n")), (Corners3{{0, 1, 2}}));
    expect_refused("a.obj", "v 0 0 0\nf 1 2 3\nv 1 0 0\n", "line 2: expected a vertex number 1 to 2, got 3");
}

TEST_F(MeshRead, ObjNamesTheLineOfBadInput) {
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    expect_refused("a.obj", vertices + "f 1 2 4\n", "line 4: expected a vertex number 1 to 3, got 4");
    expect_refused("a.obj", vertices + "f 1 2 0\n", "line 4: expected a vertex number 1 to 3, got 0");
    expect_refused("a.obj", vertices + "f -1 -2 -4\n", "line 4: expected a vertex number -3 to -1, got -4");
    expect_refused("a.obj", vertices + "f 1 2 99999999999\n", "line 4: ");
    expect_refused("a.obj", vertices + "f 1 2\n", "line 4: expected a face of at least 3 corners, got 2");
    expect_refused("a.obj", vertices + "f 1 2 3.5\n", "'3.5'");
    expect_refused("a.obj", vertices + "f 1 2 x\n", "'x'");
    expect_refused("a.obj", vertices + "f 1/1 2/2 3/x\n",
                   "line 4: expected a vertex number i, i/j, i//k or i/j/k, got '3/x'");
    expect_refused("a.obj", "v 0 0 nan\n", "line 1: expected a finite number, got 'nan'");
    expect_refused("a.obj", "\n\nv 0 inf 0\n", "line 3: expected a finite number, got 'inf'");
    expect_refused("a.obj", "v 0 1e999 0\n", "line 1: expected a finite number, got '1e999'");
    expect_refused("a.obj", "v 0 0\n", "line 1: expected three coordinates");
    expect_refused("a.obj", "v 0 0,5 0\n", "line 1: expected a number, got '0,5'");
    expect_refused("a.obj", "v 0 0x10 0\n", "'0x10'");
    expect_refused("a.obj", "hello world\n", "line 1: expected an OBJ keyword");
    expect_refused("a.obj", std::string("\x00\x01\x02\n", 4), "'\\x00\\x01\\x02'");
}

TEST_F(MeshRead, NumbersAreReadToTheLastBitWhateverTheirForm) {
    const Mesh mesh = read("a.obj",
                           "v 0.1 -0 4.9406564584124654e-324\nv 1e-999 -1e-999 0.30000000000000004\n"
                           "v 179769313486231570000000000000000e276 +.5 00012.500\n");
    EXPECT_EQ(mesh.vertices(0, 0), 0.1);
    EXPECT_EQ(mesh.vertices(2, 0), std::numeric_limits<double>::denorm_min());
    EXPECT_EQ(mesh.vertices(0, 1), 0.0);
    EXPECT_EQ(mesh.vertices(1, 1), 0.0);
    EXPECT_EQ(mesh.vertices(2, 1), 0.1 + 0.2);
    EXPECT_EQ(mesh.vertices(0, 2), std::numeric_limits<double>::max());
    EXPECT_EQ(mesh.vertices(1, 2), 0.5);
    EXPECT_EQ(mesh.vertices(2, 2), 12.5);
}

// ---- STL ------------------------------------------------------------------------------------------------------------

TEST_F(MeshRead, BinaryStlIsWeldedInOrderOfFirstAppearance) {
    const Mesh mesh = read("a.STL", binary_stl(two_facets));
    EXPECT_EQ(mesh.format, "stl-binary");
    EXPECT_EQ(mesh.vertices_stored, 6);
    EXPECT_EQ(mesh.vertices.cols(), 4);
    EXPECT_EQ(mesh.vertices.col(3), Vector3(1, 1, 0));
    EXPECT_EQ(corners(mesh), (Corners3{{0, 1, 2}, {1, 3, 2}}));
}

TEST_F(MeshRead, TheSizeDecidesBetweenBinaryAndTextNotTheWordSolid) {
    EXPECT_EQ(read("a.stl", binary_stl(two_facets, "solid but binary")).format, "stl-binary");
    EXPECT_EQ(read("a.stl", "solid name of it\n" + text_facet + "endsolid name of it\n").format, "stl-ascii");
    EXPECT_EQ(read("a.stl", binary_stl({})).triangles.cols(), 0);
}

TEST_F(MeshRead, BinaryStlReportsBytesPromisedAndBytesThere) {
    const std::string good = binary_stl(two_facets);
    expect_refused("a.stl", good.substr(0, 150),
                   "byte 80: expected 184 bytes for the 2 facets that the header promises, got 150 bytes");
    expect_refused("a.stl", good + "x", "got 185 bytes");
    expect_refused("a.stl", binary_stl(two_facets, "solid but binary").substr(0, 180), "expected 184 bytes");
    std::string many = good;
    for (std::size_t i = 80; i < 84; ++i) many[i] = '\xff';
    expect_refused("a.stl", many, "214748364834 bytes for the 4294967295 facets");
    expect_refused("a.stl", good.substr(0, 40), "at least 84 bytes");
    expect_refused("a.stl", "", "got 0 bytes");
    auto facets = two_facets;
    facets[1][4] = std::numeric_limits<float>::quiet_NaN();
    expect_refused("a.stl", binary_stl(facets), "byte 162: expected a finite number (facet 1, corner 1), got nan");
}

TEST_F(MeshRead, TextStlTakesSeveralSolidsAnyCaseAndAnyLayout) {
    const Mesh mesh =
        read("a.stl",
             "  SOLID facet of words\r\nFacet Normal nan nan nan OUTER LOOP\r\nvertex 0 0 0 vertex 1.0E0 0 "
             "0\r\n vertex 0 +1e+0 -0\r\nendloop endfacet\r\nendsolid\r\nsolid two\r\n" +
                 text_facet + "endsolid two");
    EXPECT_EQ(mesh.format, "stl-ascii");
    EXPECT_EQ(mesh.vertices_stored, 6);
    EXPECT_EQ(corners(mesh), (Corners3{{0, 1, 2}, {0, 1, 2}}));
    EXPECT_EQ(read("b.stl", "solid nothing\nendsolid nothing\n").triangles.cols(), 0);
    const Mesh two_words =
        read("b.stl", "solid one\n" + text_facet + "end solid one\nsolid two\n" + text_facet + "END SOLID\n");
    EXPECT_EQ(two_words.triangles.cols(), 2);
    expect_refused("b.stl", "solid one\n" + text_facet + "end\n", "expected 'end solid', got end of file");
}

TEST_F(MeshRead, TextStlNamesTheLineOfBadInput) {
    const std::string start = "solid a\n" + text_facet;
    expect_refused("a.stl", start, "line 8: expected 'facet' or 'endsolid', got end of file");
    expect_refused("a.stl", start.substr(0, 60), "got end of file");
    expect_refused("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 nan\n",
                   "line 4: expected a finite number, got 'nan'");
    expect_refused("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 zero\n",
                   "line 4: expected a number, got 'zero'");
    expect_refused("a.stl", "solid a\nfacet normal 0 0 1\nouter hoop\n", "line 3: expected 'loop', got 'hoop'");
    expect_refused("a.stl", "solid a\nfacets\n", "line 2: expected 'facet' or 'endsolid', got 'facets'");
    expect_refused("a.stl", start + "endsolid a\nmore\n", "line 10: expected 'solid', got 'more'");
}

// ---- PLY ------------------------------------------------------------------------------------------------------------

std::string ply_header(const std::string& format, const std::string& rest) {
    return "ply\nformat " + format + " 1.0\ncomment made by a test\n" + rest + "end_header\n";
}

TEST_F(MeshRead, TextPlyPassesOverUnknownElementsAndProperties) {
    const Mesh mesh =
        read("a.ply", ply_header("ascii",
                                 "obj_info x\nelement camera 1\nproperty float f\nproperty list uchar int "
                                 "ids\nelement vertex 4\nproperty double z\nproperty uchar red\nproperty "
                                 "float x\nproperty list uchar float w\nproperty int y\nelement face 2\n"
                                 "property float quality\nproperty list uchar int vertex_index\nelement "
                                 "edge 1\nproperty int a\nelement nothing 1000000000000\n") +
                          "0.5 3 7 8 9\n0.25 255 0 0 0\n0.25 1 1 2 0.5 0.5 0\n0.25 1 1 0 1\n0.25 1 0 0 "
                          "1\n0.5 4 0 1 2 3\n\nnan 3 0 1 2\n-1\n");
    EXPECT_EQ(mesh.format, "ply-ascii");
    EXPECT_EQ(mesh.vertices.col(2), Vector3(1, 1, 0.25));
    EXPECT_EQ(corners(mesh), (Corners3{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}}));
}

class PlyBytes : public MeshRead, public testing::WithParamInterface<bool> {};

TEST_P(PlyBytes, BinaryPlyReadsEveryTypeInItsByteOrder) {
    const bool big = GetParam();
    std::string body;
    const auto vertex = [&body, big](float x, double y, std::int32_t z) {
        put_u32(body, std::bit_cast<std::uint32_t>(x), big);
        body.append("\x07", 1);  // a uchar that is passed over
        put_u64(body, std::bit_cast<std::uint64_t>(y), big);
        put_u32(body, static_cast<std::uint32_t>(z), big);
    };
    vertex(0.5F, 0.1, -2);
    vertex(1.5F, 0.2, 3);
    vertex(0.5F, 1e-300, 70000);
    // Face: a ushort list that is passed over, then a list of 3 with a uint count and short numbers.
    const auto put_u16 = [&body, big](unsigned value) {
        const char low = static_cast<char>(value & 0xffU);
        const char high = static_cast<char>(value >> 8U);
        body.push_back(big ? high : low);
        body.push_back(big ? low : high);
    };
    body.push_back(2);
    put_u16(513);
    put_u16(65535);
    put_u32(body, 3, big);
    for (const unsigned corner : {2U, 0U, 1U}) put_u16(corner);
    const std::string header = ply_header(big ? "binary_big_endian" : "binary_little_endian",
                                          "element vertex 3\nproperty float32 x\nproperty uint8 c\nproperty float64 y\n"
                                          "property int32 z\nelement face 1\nproperty list uchar ushort skip\nproperty "
                                          "list uint short vertex_indices\n");
    const Mesh mesh = read("a.ply", header + body);
    EXPECT_EQ(mesh.format, "ply-binary");
    EXPECT_EQ(mesh.vertices.col(0), Vector3(0.5, 0.1, -2));
    EXPECT_EQ(mesh.vertices.col(2), Vector3(0.5, 1e-300, 70000));
    EXPECT_EQ(corners(mesh), (Corners3{{2, 0, 1}}));

    expect_refused("a.ply", header + body.substr(0, body.size() - 1), "end of file");
    expect_refused("a.ply", header + body.substr(0, 30), "line 4: expected 3 rows of element 'vertex'");
    expect_refused("a.ply", header + body + "x", "got 1 more bytes");
    std::string out_of_range = body;
    out_of_range[out_of_range.size() - (big ? 1 : 2)] = 3;
    expect_refused("a.ply", header + out_of_range, "expected a vertex number 0 to 2 (face 0), got 3");
    std::string not_finite = body;
    for (const std::size_t i : {0U, 1U, 2U, 3U}) not_finite[i] = '\xff';
    expect_refused("a.ply", header + not_finite,
                   "byte " + std::to_string(header.size()) + ": expected a finite number (vertex 0)");
}

INSTANTIATE_TEST_SUITE_P(ByteOrders, PlyBytes, testing::Bool());

TEST_F(MeshRead, PlyHeaderLinesMayEndInCrLf) {
    std::string header =
        ply_header("binary_little_endian", "element vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z\n");
    for (std::size_t at = header.find('\n'); at != std::string::npos; at = header.find('\n', at + 2)) {
        header.insert(at, "\r");
    }
    EXPECT_EQ(read("a.ply", header + "\n\r\x03").vertices.col(0), Vector3(10, 13, 3));
}

TEST_F(MeshRead, PlyTriangleStripsKeepOneOrientation) {
    const Mesh mesh =
        read("a.ply", ply_header("ascii",
                                 "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                                 "element tristrips 1\nproperty list int int vertex_indices\n") +
                          "0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 3 2 1\n");
    EXPECT_EQ(corners(mesh), (Corners3{{0, 1, 2}, {2, 1, 3}, {3, 2, 1}}));
}

TEST_F(MeshRead, PlyNamesLineOrByteOfBadInput) {
    const std::string elements =
        "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar "
        "int "
        "vertex_indices\n";
    const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n";
    const auto expect_body_refused = [&](const std::string& body, const std::string& part) {
        expect_refused("a.ply", ply_header("ascii", elements) + body, part);
    };
    EXPECT_EQ(refusal("a.ply", ply_header("ascii", elements) + vertices + "3 0 1 2"), "");
    expect_body_refused(vertices, "line 8: expected 1 rows of element 'face' after the header, got only 18 bytes");
    expect_body_refused("0 0 0\n1 0 0\n0.000000000000000000 1 0\n", "line 13: expected face 0 of 1, got end of file");
    expect_body_refused(vertices + "3 0 1 3\n", "line 14: expected a vertex number 0 to 2 (face 0), got 3");
    expect_body_refused(vertices + "3 0 1 -1\n", "got -1");
    expect_body_refused(vertices + "2 0 1\n", "expected at least 3 corners (face 0), got 2");
    expect_body_refused(vertices + "4 0 1 2\n", "line 14: ");
    expect_body_refused(vertices + "3 0 1 2 2\n", "line 14: expected no more values for face 0, got '2'");
    expect_body_refused(vertices + "3 0 1 2\n3 0 1 2\n", "line 15: expected end of file");
    expect_body_refused(vertices + "2000000000 0 1 2\n", "got 2000000000 entries");
    expect_body_refused("0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n", "line 12: expected a finite number (vertex 1)");
    expect_body_refused("0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "line 12: expected more values for vertex 1");
    expect_refused(
        "a.ply",
        ply_header("binary_little_endian",
                   "element vertex 4000000000000000000\nproperty float x\nproperty float y\nproperty float z\n"),
        "got only 0 bytes");
    expect_refused("a.ply", ply_header("ascii", "element vertex 1\nproperty float x\nproperty float y\n") + "0 0\n",
                   "a property 'z' of element 'vertex'");
    expect_refused("a.ply", ply_header("ascii", "element face 0\nproperty list uchar int vertex_indices\n"),
                   "an element 'vertex'");
    expect_refused("a.ply", ply_header("ascii", "element vertex 1\nproperty real x\n"), "line 5: expected a type");
    expect_refused("a.ply", ply_header("text", ""), "line 2: expected 'ascii'");
    expect_refused("a.ply", "plx\n", "line 1: expected 'ply'");
    expect_refused("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n",
                   "line 3: expected 'end_header', got end of file");
    expect_refused("a.ply", "ply\nformat ascii 1.0\nelephant vertex 3\nend_header\n", "line 3: expected 'format'");
    expect_refused("a.ply", "", "expected 'ply'");
}

// ---- OFF ------------------------------------------------------------------------------------------------------------

TEST_F(MeshRead, OffTakesItsVariantsCommentsAndColours) {
    const Corners3 expected{{0, 1, 2}, {0, 2, 3}, {3, 2, 0}};
    const std::string faces = "4 0 1 2 3 255 0 0\n3 3 2 0\n";
    for (const std::string& text : {
             "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n" + faces,
             "OFF 4 2 0\n# comment\n\n0 0 0 # first\n1 0 0\n1 1 0\n0 1 0\n" + faces,
             "# head\nCOFF\r\n4 2 5\r\n0 0 0 1 0 0 1\r\n1 0 0 1 0 0 1\r\n1 1 0 1 0 0 1\r\n0 1 0 1 0 0 1\r\n" + faces,
             "NOFF\n4 2\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 0 0 1\n" + faces,
             "STOFF\n4 2 0\n0 0 0 0 0\n1 0 0 0 1\n1 1 0 1 1\n0 1 0 1 0\n" + faces,
             "4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n" + faces,
         }) {
        const Mesh mesh = read("a.off", text);
        EXPECT_EQ(mesh.format, "off");
        EXPECT_EQ(corners(mesh), expected) << text;
        EXPECT_EQ(mesh.vertices.col(2), Vector3(1, 1, 0)) << text;
    }
    EXPECT_EQ(read("empty.off", "OFF\n0 0 0\n").triangles.cols(), 0);
}

TEST_F(MeshRead, OffNamesTheLineOfBadInput) {
    const std::string start = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n";
    expect_refused("a.off", start, "line 2: expected 3 vertices and 1 faces after the header, got only 18 bytes");
    expect_refused("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0.00000000 1 0\n",
                   "line 5: expected face 0 of 1, got end of file");
    expect_refused("a.off", "OFF\n9000000000000000000 1 0\n", "got only 0 bytes");
    expect_refused("a.off", start + "3 0 1 3\n", "line 6: expected a vertex number 0 to 2, got '3'");
    expect_refused("a.off", start + "3 0 1 -1\n", "got '-1'");
    expect_refused("a.off", start + "4 0 1 2\n", "line 6: expected 4 corners of face 0, got 3");
    expect_refused("a.off", start + "2 0 1 255\n", "at least 3 corners (face 0), got 2");
    expect_refused("a.off", start + "3 0 1 2\n3 0 1 2\n", "line 7: expected nothing after the 1 faces");
    expect_refused("a.off", "OFF\n3 1 0\n0 0 0\n1 -inf 0\n0 1 0\n3 0 1 2\n",
                   "line 4: expected a finite number, got '-inf'");
    expect_refused("a.off", "OFF\n3 1 0\n0 0 0\n1 0\n0 1 0 # c\n3 0 1 2\n",
                   "line 4: expected three coordinates of vertex 1");
    expect_refused("a.off", "OFX\n3 1 0\n", "line 1: expected 'OFF'");
    expect_refused("a.off", "OFF BINARY\n", "'BINARY'");
    expect_refused("a.off", "4OFF\n1 0 0\n0 0 0 1\n", "'4OFF'");
    expect_refused("a.off", "OFF\n-3 1 0\n", "line 2: expected the number of vertices, got '-3'");
    expect_refused("a.off", "", "got end of file");
}

// ---- VRML -----------------------------------------------------------------------------------------------------------

const std::string vrml = "#VRML V2.0 utf8\n";
const std::string triangle_set =
    "IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 ] } coordIndex [ 0, 1, 2, -1 ] }";

TEST_F(MeshRead, VrmlAppliesNestedTransformsInTheOrderOfTheStandard) {
    // Turned by 90 degrees about z around (1, 0, 0), after a scale of 2 along the axis that lies at 45 degrees.
    const Mesh turned =
        read("a.wrl", vrml +
                          "Transform { translation 10 0 0 children [ Transform { center 1 0 0 rotation 0 0 "
                          "2 1.5707963267948966 children Shape { geometry " +
                          triangle_set + " } } ] }");
    EXPECT_EQ(turned.format, "vrml");
    EXPECT_LT((turned.vertices.col(0) - Vector3(11, -1, 0)).norm(), 1e-15);
    EXPECT_LT((turned.vertices.col(1) - Vector3(11, 0, 0)).norm(), 1e-15);
    EXPECT_LT((turned.vertices.col(2) - Vector3(10, -1, 0)).norm(), 1e-15);
    const Mesh stretched =
        read("b.wrl", vrml +
                          "Transform { scale 3 1 1 scaleOrientation 0 0 1 0.78539816339744831 children "
                          "[ Shape { geometry " +
                          triangle_set + " } ] }");
    // (1, 0) = half along the stretched diagonal, half across: 3 · (.5, .5) + (.5, -.5) = (2, 1).
    EXPECT_LT((stretched.vertices.col(1) - Vector3(2, 1, 0)).norm(), 1e-15);
    EXPECT_LT((stretched.vertices.col(2) - Vector3(1, 2, 0)).norm(), 1e-15);
}

TEST_F(MeshRead, VrmlCountsShapesOnAndFollowsDefAndUse) {
    const Mesh mesh =
        read("a.WRL", vrml +
                          "# comment with { and [\n"
                          "PROTO Thing [ field SFFloat size 1 eventIn SFBool on ] { Shape { geometry " +
                          triangle_set +
                          " } }\n"
                          "EXTERNPROTO Other [ field SFInt32 n ] [ \"a.wrl\" ]\n"
                          "WorldInfo { title \"a } \\\" ]\" info [ \"x\", \"y\" ] }\n"
                          "NavigationInfo { type [ \"EXAMINE\" \"ANY\" ] headlight FALSE }\n"
                          "DEF LOOK Appearance { material Material { diffuseColor 1 0 0 } texture PixelTexture { image "
                          "1 2 1 0xFF 0x00 } }\n"
                          "DEF FIRST Shape { appearance USE LOOK geometry DEF SET " +
                          triangle_set +
                          " }\n"
                          "Group { children [ Transform { translation 0 0 5 children [ USE FIRST, NULL ] }\n"
                          "  Shape { geometry IndexedFaceSet { coord DEF POINTS Coordinate { point [ 0 0 7 1 0 7 1 1 7 "
                          "0 1 7 ] } ccw FALSE"
                          " coordIndex [ 0 1 2 3 ] solid FALSE creaseAngle 3.14 } } ] }\n"
                          "DEF SCRIPT Script { url \"javascript:f() { }\" eventIn SFTime t field SFNode n USE FIRST "
                          "eventOut SFBool b }\n"
                          "Switch { whichChoice 1 choice [ USE FIRST Shape { geometry IndexedFaceSet { coord USE "
                          "POINTS coordIndex [ 0 2 1 "
                          "-1 -1 ] } } ] }\n"
                          "Switch { choice USE FIRST }\n"
                          "LOD { range [ 10 ] level [ USE FIRST Group { } ] }\n"
                          "Shape { geometry IndexedFaceSet { coord NULL coordIndex [ ] } }\n"
                          "Shape { geometry Sphere { radius 2 } }\n"
                          "ROUTE SCRIPT.b TO FIRST.set_x\n");
    EXPECT_EQ(corners(mesh), (Corners3{{0, 1, 2}, {3, 4, 5}, {6, 8, 7}, {6, 9, 8}, {10, 12, 11}, {14, 15, 16}}));
    EXPECT_EQ(mesh.vertices_stored, 17);
    EXPECT_EQ(mesh.vertices(2, 3), 5.0);
    EXPECT_EQ(mesh.vertices(2, 6), 7.0);
    EXPECT_EQ(mesh.ignored,
              (std::vector<std::string>{"line 3: prototype Thing", "line 4: prototype Other", "line 16: Sphere"}));
    // A misspelt field leaves its surface out, which is reported.
    const Mesh misspelt =
        read("b.wrl", vrml + "Shape { geometri " + triangle_set + " }\nTransform { child [ Shape { geometry " +
                          triangle_set + " } ] }\nShape { geometry " + triangle_set + " }\n");
    EXPECT_EQ(misspelt.triangles.cols(), 1);
    EXPECT_EQ(misspelt.ignored, (std::vector<std::string>{"line 2: IndexedFaceSet in field 'geometri' of Shape",
                                                          "line 3: Shape in field 'child' of Transform"}));
}

TEST_F(MeshRead, VrmlNamesTheLineOfBadInput) {
    const auto set = [](const std::string& points, const std::string& index) {
        return vrml + "Shape { geometry IndexedFaceSet {\n coord Coordinate { point [ " + points +
               " ] }\n coordIndex [ " + index + " ] } }\n";
    };
    const std::string points = "0 0 0, 1 0 0, 0 1 0";
    EXPECT_EQ(refusal("a.wrl", set(points, "0 1 2 -1")), "");
    expect_refused("a.wrl", set(points, "0 1 3 -1"), "line 4: expected a vertex number 0 to 2 or -1, got '3'");
    expect_refused("a.wrl", set(points, "0 1 -2 -1"), "got '-2'");
    expect_refused("a.wrl", set(points, "0 1 1.5 -1"), "got '1.5'");
    expect_refused("a.wrl", set(points, "0 1 -1"), "line 4: expected a face of at least 3 corners, got 2");
    expect_refused("a.wrl", set("0 0 0 nan 0 0", "-1"), "line 3: expected a finite number in 'point', got 'nan'");
    expect_refused("a.wrl", set("0 0 0 1", "-1"), "line 3: expected three coordinates for every point, got 4 numbers");
    expect_refused("a.wrl", set("0 0 1.2.3", "-1"), "line 3: expected a number, got '1.2.3'");
    expect_refused("a.wrl", vrml + "Group { children [ USE NOBODY ] }",
                   "line 2: expected a name that DEF has given before, got 'NOBODY'");
    expect_refused("a.wrl", vrml + "DEF A Group { children [ USE A ] }", "got 'A'");
    expect_refused("a.wrl", vrml + "Group { children [\n", "got end of file");
    expect_refused("a.wrl", vrml + "Group {\n", "line 3: expected '}' of the Group of line 2, got end of file");
    expect_refused("a.wrl", vrml + "WorldInfo { title \"open\n", "closing quote");
    expect_refused("a.wrl", vrml + "Transform { translation 1 2 children [ ] }",
                   "expected 3 numbers after 'translation', got 2");
    expect_refused("a.wrl", vrml + "Transform { rotation 0 0 0 1 children [ ] }",
                   "an axis other than zero in 'rotation'");
    expect_refused("a.wrl", vrml + "}", "line 2: expected a node, got '}'");
    expect_refused("a.wrl", "#VRML V1.0 ascii\nSeparator { }\n",
                   "line 1: expected '#VRML V2.0 utf8', got '#VRML V1.0 ascii'");
    expect_refused("a.wrl", "", "expected '#VRML V2.0 utf8'");
    expect_refused("a.wrl", std::string("\x1f\x8b\x08\x00", 4), "gzip");
}

TEST_F(MeshRead, VrmlTakesWholeNumbersOfBaseSixteenWithTheirSign) {
    // ISO 14772, annex A: a whole number is [+-]?([0-9]+|0[xX][0-9a-fA-F]+).
    const auto set = [](const std::string& index) {
        std::string points;
        for (int i = 0; i < 32; ++i) points += std::to_string(i) + " " + std::to_string(i * i) + " 0, ";
        return vrml + "Shape { geometry IndexedFaceSet {\n coord Coordinate { point [ " + points +
               "] }\n coordIndex [ " + index + " ] } }\n";
    };
    EXPECT_EQ(corners(read("a.wrl", set("0x0 0X1 0x1f -0x1 0x0a +0xF 0x1B -0X01 9 0xC 0x1E"))),
              (Corners3{{0, 1, 31}, {10, 15, 27}, {9, 12, 30}}));
    expect_refused("a.wrl", set("0 1 0xDe"), "line 4: expected a vertex number 0 to 31 or -1, got '222'");
    expect_refused("a.wrl", set("0 1 -0x2"), "got '-2'");
    expect_refused("a.wrl", set("0 1 0x"), "line 4: expected a number, got '0x'");
    expect_refused("a.wrl", set("0 1 0x1g"), "line 4: expected a number, got '0x1g'");
}

TEST_F(MeshRead, VrmlMadeToExhaustStackOrMemoryIsRefused) {
    std::string deep = vrml;
    for (int i = 0; i < 100000; ++i) deep += "Group { children [ ";
    expect_refused("deep.wrl", deep, "nested at most 500 deep");
    std::string doubling = vrml + "DEF A0 Group { }\n";
    for (int i = 1; i < 60; ++i) {
        const std::string before = "USE A" + std::to_string(i - 1);
        doubling += "DEF A" + std::to_string(i) + " Group { children [ " + before + " " + before + " ] }\n";
    }
    expect_refused("doubling.wrl", doubling, "at most 10000000 nodes after USE");
}

// ---- all formats ----------------------------------------------------------------------------------------------------

TEST_F(MeshRead, ExtensionDecidesAndAnUnknownOneLeavesItToTheContent) {
    EXPECT_EQ(read("a.mesh", "OFF\n0 0 0\n").format, "off");
    EXPECT_EQ(read("noext", vrml).format, "vrml");
    EXPECT_EQ(read("a.txt", "\xef\xbb\xbfsolid x\nendsolid x\n").format, "stl-ascii");
    expect_refused("a.xyz", "1 2 3\n",
                   "expected a mesh file (.obj .stl .ply .off .vtk .vtp .wrl .vrml), got the extension '.xyz'");
    expect_refused("a.stl", "ply\nformat ascii 1.0\n", "an STL file");
    expect_refused("a.obj", "OFF\n0 0 0\n", "line 1: expected an OBJ keyword");
}

TEST_F(MeshRead, MissingFileAndFolderAreNamed) {
    test::expect_holds(test::complaint_of([this] { read_mesh(folder_.path() / "nowhere.stl"); }),
                       {"nowhere.stl: expected a mesh file, got no such file"});
    EXPECT_THROW(read_mesh(folder_.path()), InputError);
}

TEST_F(MeshRead, AStatedUnitIsTakenFromComments) {
    EXPECT_EQ(read("a.obj", "# File units = Millimeters\nv 0 0 0\n").stated_unit, "mm");
    EXPECT_EQ(read("a.off", "OFF # unit: cm\n0 0 0\n").stated_unit, "cm");
    EXPECT_EQ(read("a.stl", binary_stl(two_facets, "exported, UNITS=m, by x")).stated_unit, "m");
    EXPECT_EQ(read("a.obj", "# 12 units of length\n# community: m\nv 0 0 0\n").stated_unit, "");
}

TEST_F(MeshRead, WrittenObjReadsBackBitForBit) {
    Matrix3X vertices(3, 3);
    vertices << 0.1, 1e-300, -0.0, 1.0 / 3.0, -12345678.9, 4.9e-324, 2.5e300, 0, 3;
    Triangles triangles(3, 2);
    triangles << 0, 2, 1, 1, 2, 1;
    const std::filesystem::path file = folder_.path() / "out.obj";
    write_obj(file, vertices, triangles);
    const Mesh mesh = read_mesh(file);
    ASSERT_EQ(mesh.vertices.cols(), 3);
    for (Eigen::Index k = 0; k < vertices.size(); ++k) {
        EXPECT_EQ(std::bit_cast<std::uint64_t>(mesh.vertices.data()[k]),
                  std::bit_cast<std::uint64_t>(vertices.data()[k]));
    }
    EXPECT_EQ(mesh.triangles, triangles);
    EXPECT_THROW(write_obj(folder_.path() / "no" / "folder.obj", vertices, triangles), InputError);
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) EXPECT_EQ(entry.path(), file);
}

TEST(MeshPose, ScaleThenRotationThenTranslation) {
    Matrix3X vertices(3, 2);
    vertices << 1, 0, 0, 2, 0, 0;
    pose_vertices(2.0, Vector3(10, 0, 0), Vector3(0, 0, 90), vertices);
    EXPECT_LT((vertices.col(0) - Vector3(10, 2, 0)).norm(), 1e-15);
    EXPECT_LT((vertices.col(1) - Vector3(6, 0, 0)).norm(), 1e-15);
    // 120 degrees about the diagonal moves x to y to z.
    Matrix3X axes = Matrix3::Identity();
    pose_vertices(1.0, Vector3::Zero(), Vector3::Constant(120.0 / std::sqrt(3.0)), axes);
    EXPECT_LT((axes.col(0) - Vector3::UnitY()).norm(), 1e-15);
    EXPECT_LT((axes.col(2) - Vector3::UnitX()).norm(), 1e-15);
}

TEST(MeshPose, NoRotationLeavesEveryBit) {
    Matrix3X vertices(3, 1);
    vertices << 0.1, -1e-300, 12345.678;
    const Matrix3X before = vertices;
    pose_vertices(1.0, Vector3::Zero(), Vector3::Zero(), vertices);
    EXPECT_EQ(vertices, before);
}

TEST(MeshWeld, MergesEqualPositionsOnly) {
    Matrix3X vertices(3, 5);
    vertices << 1, 0, 1, -0.0, std::nextafter(1.0, 2.0), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0;
    Triangles triangles(3, 2);
    triangles << 2, 4, 3, 1, 0, 0;
    weld(vertices, triangles);
    EXPECT_EQ(vertices.cols(), 3);
    EXPECT_EQ(vertices(0, 0), 1.0);
    EXPECT_EQ(triangles, (Triangles(3, 2) << 0, 2, 1, 1, 0, 0).finished());
}

}  // namespace
}  // namespace trocar
