// The flat world against bodies put together by hand.
#include "scene/world.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "geometry/input_error.hpp"
#include "support/meshes.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

Body body_of(const std::string& name, BodyKind kind, Index vertices, const test::Faces& faces) {
    return {.name = name, .kind = kind, .vertex_count = vertices, .triangles = test::matrix_of(faces)};
}

std::vector<Body> three_bodies() {
    std::vector<Body> bodies{body_of("tool", BodyKind::instrument, 3, {{0, 1, 2}}),
                             body_of("point", BodyKind::rigid, 1, {}),
                             body_of("sheet", BodyKind::tissue, 4, {{0, 1, 3}, {3, 1, 2}})};
    bodies[2].closed = false;
    bodies[2].start_side = SheetSide::back;
    bodies[0].instrument = "left";
    return bodies;
}

TEST(Topology, LaysBodiesOutOneAfterTheOther) {
    const Topology topology = make_topology(three_bodies());
    ASSERT_EQ(topology.body_count(), 3);
    EXPECT_EQ(topology.vertex_count, 8);
    EXPECT_EQ(topology.bodies[0].vertices, (Range{0, 3}));
    EXPECT_EQ(topology.bodies[1].vertices, (Range{3, 1}));
    EXPECT_EQ(topology.bodies[2].vertices, (Range{4, 4}));
    EXPECT_EQ(topology.bodies[0].triangles, (Range{0, 1}));
    EXPECT_EQ(topology.bodies[1].triangles, (Range{1, 0}));
    EXPECT_EQ(topology.bodies[2].triangles, (Range{1, 2}));
    Triangles expected(3, 3);
    expected << 0, 4, 7,  //
        1, 5, 5,          //
        2, 7, 6;
    EXPECT_EQ(topology.triangles, expected);
    EXPECT_EQ(topology.body_of_triangle, (std::vector<Index>{0, 2, 2}));
    EXPECT_EQ(topology.bodies[0].instrument, "left");
    EXPECT_EQ(topology.bodies[2].name, "sheet");
    EXPECT_EQ(topology.bodies[2].kind, BodyKind::tissue);
    EXPECT_EQ(topology.bodies[2].start_side, SheetSide::back);
    EXPECT_FALSE(topology.bodies[2].closed);
    EXPECT_TRUE(topology.bodies[1].closed);
    const std::array<Index, 10> bodies{-1, 0, 0, 0, 1, 2, 2, 2, 2, -1};
    for (Index v = -1; v < 9; ++v) EXPECT_EQ(topology.body_of_vertex(v), bodies.at(static_cast<std::size_t>(v + 1)));
}

TEST(Topology, PairsAreAllButRigidOnesAndThoseOfOneInstrument) {
    std::vector<Body> bodies = three_bodies();
    bodies.push_back(body_of("bone", BodyKind::rigid, 1, {}));
    bodies.push_back(body_of("jaw", BodyKind::instrument, 1, {}));
    bodies.back().instrument = "left";
    bodies.push_back(body_of("hook", BodyKind::instrument, 1, {}));
    const Topology topology = make_topology(bodies);
    Index next = 0;
    for (Index a = 0; a < 6; ++a) {
        for (Index b = a + 1; b < 6; ++b) {
            const bool rigid = a == 1 && b == 3;
            const bool left = a == 0 && b == 4;
            const Index expected = rigid || left ? -1 : next++;
            EXPECT_EQ(topology.body_pair(a, b), expected) << a << ' ' << b;
            EXPECT_EQ(topology.body_pair(b, a), expected) << b << ' ' << a;
        }
    }
    EXPECT_EQ(static_cast<Index>(topology.body_pairs.size()), next);
}

TEST(Topology, ListedPairsAreSortedAndEachOnce) {
    using Pair = std::array<Index, 2>;
    const std::vector<Pair> listed{Pair{2, 1}, Pair{1, 0}, Pair{1, 2}, Pair{0, 1}};
    EXPECT_EQ(make_topology(three_bodies(), listed).body_pairs, (std::vector<Pair>{Pair{0, 1}, Pair{1, 2}}));
    for (const Pair& bad : {Pair{0, 3}, Pair{3, 0}, Pair{-1, 0}, Pair{0, -1}, Pair{1, 1}}) {
        EXPECT_THROW((void)make_topology(three_bodies(), {bad}), InputError) << bad[0] << ' ' << bad[1];
    }
}

TEST(Topology, RefusesVerticesThatABodyHasNotAndNamesItHasTwice) {
    for (const Index vertex : {-1, 4, 5}) {
        for (int corner = 0; corner < 3; ++corner) {
            std::vector<Body> bodies = three_bodies();
            bodies[2].triangles(corner, 1) = vertex;
            EXPECT_EQ(test::complaint_of([&] { (void)make_topology(bodies); }),
                      "body 'sheet': triangle 1: expected vertex numbers 0 to 3, got " + std::to_string(vertex));
        }
    }
    std::vector<Body> twice = three_bodies();
    twice[2].name = "tool";
    EXPECT_THROW((void)make_topology(twice), InputError);
    std::vector<Body> fewer_than_none = three_bodies();
    fewer_than_none[1].vertex_count = -1;
    EXPECT_THROW((void)make_topology(fewer_than_none), InputError);
}

TEST(FrameHash, IsFnv1aOverTheBytesOfTickAndPosition) {
    Frame frame;
    frame.tick = 258;
    frame.position.resize(3, 2);
    frame.position << 0.1, -0.2, 3.0, 1e-300, -0.0, 7e5;
    const std::int64_t tick = frame.tick;
    std::array<unsigned char, 7 * 8> bytes{};
    std::memcpy(bytes.data(), &tick, 8);
    std::memcpy(bytes.data() + 8, frame.position.data(), 6 * 8);
    std::uint64_t expected = 0xcbf29ce484222325ULL;
    for (const unsigned char byte : bytes) expected = (expected ^ byte) * 0x100000001b3ULL;
    EXPECT_EQ(frame.hash(), expected);
}

}  // namespace
}  // namespace trocar
