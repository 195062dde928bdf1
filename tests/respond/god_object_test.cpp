// The proxy of a tip against bone: closed forms on planes and in corners, and that it never gets inside, however the
// device is moved.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "geometry/orientation.hpp"
#include "respond/tip_proxy.hpp"
#include "support/closed_loop.hpp"
#include "support/meshes.hpp"
#include "support/random_vectors.hpp"
#include "support/response_samples.hpp"

namespace trocar {
namespace {

constexpr double r = 5e-4;

using test::Shape;

/// One rigid body and a proxy against all its triangles.
struct Bone {
    Topology topology;
    Matrix3X position;
    GodObject object;
    std::vector<Index> all;

    explicit Bone(const Shape& mesh, bool closed = true) : position(test::matrix_of(mesh.vertices)) {
        topology = test::make_world("bone", {{.kind = BodyKind::rigid, .shape = mesh, .closed = closed}}).topology;
        all.resize(mesh.triangles.size());
        std::iota(all.begin(), all.end(), 0);
        object.prepare(r);
    }

    Vector3 follow(const Vector3& device) { return object.follow(topology, position, all, device); }

    /// How often the surface winds around a point: 1 inside, 0 outside.
    [[nodiscard]] double winding(const Vector3& x) const { return winding_number(position, topology.triangles, x); }
    [[nodiscard]] double distance(const Vector3& x) const {
        double least = std::numeric_limits<double>::infinity();
        for (Index t = 0; t < topology.triangle_count(); ++t) {
            const Corners c = corners_of(topology.triangles, position, t);
            const Vector3 w = closest_point_on_triangle(c, x);
            least = std::min(least, (w[0] * c[0] + w[1] * c[1] + w[2] * c[2] - x).norm());
        }
        return least;
    }
};

/// Closed box between two corners; faces share positions, not vertex numbers.
Shape box_mesh(const Vector3& low, const Vector3& high, int n) {
    const Vector3 e = high - low;
    const Vector3 x(e.x(), 0, 0);
    const Vector3 y(0, e.y(), 0);
    const Vector3 z(0, 0, e.z());
    using test::rectangle;
    Shape mesh = rectangle(low, y, x, n);
    for (const Shape& side : {rectangle(low + z, x, y, n), rectangle(low, x, z, n), rectangle(low + y, z, x, n),
                              rectangle(low, z, y, n), rectangle(low + x, y, z, n)}) {
        mesh.add(side);
    }
    return mesh;
}

TEST(GodObject, FollowsFreelyAndRestsOnAPlaneUnderTheDevice) {
    for (const int n : {1, 7, 40}) {
        Bone bone(test::sheet(0.1, n), false);
        EXPECT_EQ(bone.follow(Vector3(0.001, 0.002, 0.01)), Vector3(0.001, 0.002, 0.01));
        EXPECT_EQ(bone.object.active_planes(), 0);
        for (const double depth : {0.0001, 0.003, 0.02}) {
            const Vector3 proxy = bone.follow(Vector3(0.0013, 0.0021, r - depth));
            EXPECT_LT((proxy - Vector3(0.0013, 0.0021, r)).norm(), 1e-11) << n << " " << depth;
            EXPECT_EQ(bone.object.active_planes(), 1);
        }
        EXPECT_EQ(bone.follow(Vector3(0.001, 0.002, 0.01)), Vector3(0.001, 0.002, 0.01));
    }
}

TEST(GodObject, SlidesOverSharedEdgesAndVerticesWithoutCatching) {
    // Straight along a row of vertices and along a diagonal, deep under the floor: right above the device in every
    // tick.
    for (const Vector3& path : {Vector3(1e-4, 0, 0), Vector3(1e-4, 1e-4, 0), Vector3(0.97e-4, 0.31e-4, 0)}) {
        Bone bone(test::sheet(0.1, 20), false);
        Vector3 device(-0.04, -0.04, 0.01);
        bone.follow(device);
        device.z() = -0.004;
        for (int tick = 0; tick < 700; ++tick) {
            device += path;
            const Vector3 proxy = bone.follow(device);
            ASSERT_LT((proxy - Vector3(device.x(), device.y(), r)).norm(), 1e-9) << "tick " << tick;
        }
    }
}

TEST(GodObject, RestsInAConcaveEdgeAndInACorner) {
    Shape corner = test::sheet(0.1, 9);
    corner.add(test::rectangle(Vector3(-0.05, -0.05, 0), Vector3(0, 0.1, 0), Vector3(0, 0, 0.1), 9));
    Bone two(corner, false);
    corner.add(test::rectangle(Vector3(-0.05, -0.05, 0), Vector3(0, 0, 0.1), Vector3(0.1, 0, 0), 9));
    Bone three(corner, false);
    const Vector3 start(-0.03, -0.03, 0.02);
    const Vector3 device(-0.053, -0.052, -0.004);
    const Vector3 beside(-0.053, -0.021, -0.004);
    for (const bool at_once : {true, false}) {
        two.object.prepare(r);
        three.object.prepare(r);
        for (int step = at_once ? 40 : 0; step <= 40; ++step) {
            if (at_once) {
                two.follow(start);
                three.follow(start);
            }
            two.follow(start + step / 40.0 * (beside - start));
            three.follow(start + step / 40.0 * (device - start));
        }
        // Two walls: x and z are held, y goes with the device; three: all are held.
        EXPECT_LT((two.object.proxy() - Vector3(-0.05 + r, -0.021, r)).norm(), 1e-9);
        EXPECT_EQ(two.object.active_planes(), 2);
        EXPECT_LT((three.object.proxy() - Vector3(-0.05 + r, -0.05 + r, r)).norm(), 1e-9);
        EXPECT_EQ(three.object.active_planes(), 3);
    }
    // An oblique wall: the device's point mirrored out of both planes by hand. Wall through the y axis, inclined 30°.
    Shape valley = test::sheet(0.1, 8);
    const Vector3 slope(std::cos(std::numbers::pi / 6), 0.0, std::sin(std::numbers::pi / 6));
    valley.add(test::rectangle(Vector3(0, -0.05, 0), 0.05 * slope, Vector3(0, 0.1, 0), 8));
    Bone oblique(valley, false);
    oblique.follow(Vector3(-0.004, 0.0, 0.008));
    const Vector3 proxy = oblique.follow(Vector3(0.003, 0.001, -0.008));
    // z = r and -x sin 30° + z cos 30° = r.
    const double x = r * (std::cos(std::numbers::pi / 6) - 1.0) / std::sin(std::numbers::pi / 6);
    EXPECT_LT((proxy - Vector3(x, 0.001, r)).norm(), 1e-9);
}

TEST(GodObject, SlidesOffAConvexEdgeAndIsFree) {
    Bone bone(box_mesh(Vector3(-0.02, -0.02, -0.02), Vector3(0.02, 0.02, 0.0), 6));
    Vector3 device(0.0, 0.001, 0.01);
    bone.follow(device);
    device.z() = -0.002;
    bone.follow(device);
    bool left = false;
    for (int tick = 0; tick < 300; ++tick) {
        device.x() += 1e-4;
        const Vector3 proxy = bone.follow(device);
        if (device.x() <= 0.02) {
            EXPECT_LT((proxy - Vector3(device.x(), 0.001, r)).norm(), 1e-9);
        } else if (device.x() < 0.02 + r - 1e-6) {
            // Pressed against the side wall or the rounded edge, outside both.
            EXPECT_GE(proxy.x() - 0.02, -1e-12);
        } else if (device.x() > 0.02 + r + 1e-6) {
            left = true;
            EXPECT_LT((proxy - device).norm(), 1e-9) << tick;
        }
    }
    EXPECT_TRUE(left);
}

TEST(GodObject, RestsOnARoundedConvexEdge) {
    // Device under the edge of a box that is met from above at 45°: the nearest place of the rounded edge.
    Bone bone(box_mesh(Vector3(-0.02, -0.02, -0.02), Vector3(0.0, 0.02, 0.0), 5));
    bone.follow(Vector3(0.004, 0.001, 0.004));
    const Vector3 device(1e-4, 0.001, 1e-4);  // within r of the edge, in its Voronoi region
    Vector3 proxy;
    for (int i = 0; i < 20; ++i) proxy = bone.follow(device);
    EXPECT_LT((proxy - Vector3(r / std::sqrt(2.0), 0.001, r / std::sqrt(2.0))).norm(), 1e-7);
}

TEST(GodObject, AFastTipDoesNotGetThroughAThinPlate) {
    for (const double speed : {1.0, 30.0, 1000.0}) {
        Bone bone(box_mesh(Vector3(-0.02, -0.02, -0.0005), Vector3(0.02, 0.02, 0.0), 13));
        Vector3 device(0.0011, 0.0007, 0.02);
        for (int tick = 0; tick < 60; ++tick) {
            const Vector3 proxy = bone.follow(device);
            if (device.z() > r) {
                ASSERT_EQ(proxy, device);
            } else if (device.z() > -0.015) {
                ASSERT_NEAR(proxy.z(), r, 1e-9);
            } else {
                ASSERT_GE(proxy.z(), r - 1e-9);  // on the front, wherever the device has gone
            }
            device.z() -= speed * 1e-3;
        }
    }
}

TEST(GodObject, StartsOutsideABodyThatTheDeviceStartsIn) {
    Bone bone(box_mesh(Vector3(-0.02, -0.02, -0.02), Vector3(0.02, 0.02, 0.0), 4));
    const Vector3 proxy = bone.follow(Vector3(0.001, 0.002, -0.003));
    EXPECT_LT((proxy - Vector3(0.001, 0.002, r)).norm(), 1e-9);
}

TEST(GodObject, LeavesASurfaceOnWhichTheDeviceStarted) {
    // Powers of two, so that the point of the face that is nearest to the device is the device itself: no way out has a
    // direction.
    constexpr double half = 1.0 / 64.0;
    for (const bool closed : {true, false}) {
        // Half a rounding step beside the face, too, the way out is that of its front and not that of rounding.
        for (const double beside : {0.0, -1e-18, 1e-18}) {
            Bone bone(box_mesh(Vector3(-half, -half, -half), Vector3(half, half, 0.0), 1), closed);
            const Vector3 device(half / 4.0, -half / 2.0, beside);
            EXPECT_LT((bone.follow(device) - device - Vector3(0.0, 0.0, r)).norm(), 1e-3 * r) << closed << beside;
            const Vector3 away = device + Vector3(0.0, 0.0, 4.0 * r);
            EXPECT_LT((bone.follow(away) - away).norm(), 1e-12) << closed << beside;
        }
    }
}

TEST(GodObject, IsNeverInsideOnRandomWalksThatAimAtEdgesAndVertices) {
    std::vector<Shape> bodies{box_mesh(Vector3(-0.01, -0.01, -0.01), Vector3(0.01, 0.01, 0.01), 3),
                              test::make_shaft(0.008, 0.03, 7, 0.01)};
    // A notched body: a box with a second one standing in it upside down makes concave edges.
    bodies.push_back(box_mesh(Vector3(-0.02, -0.01, -0.02), Vector3(0.02, 0.01, 0.0), 4));
    bodies.back().add(box_mesh(Vector3(-0.004, -0.012, -0.01), Vector3(0.004, 0.012, 0.015), 3));
    std::mt19937_64 generator(11);
    std::normal_distribution<double> normal(0.0, 1.0);
    for (const Shape& mesh : bodies) {
        Bone bone(mesh);
        Vector3 device(0.03, 0.02, 0.035);
        bone.follow(device);
        int inside = 0;
        int held = 0;
        for (int tick = 0; tick < 6000; ++tick) {
            if (tick % 20 == 0) {
                // Jump beyond a vertex or an edge's middle, straight through it as seen from the proxy.
                const auto t = static_cast<std::size_t>(generator() % mesh.triangles.size());
                const Vector3 p = mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][0])];
                const Vector3 q = mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][1])];
                const Vector3 target = tick % 40 == 0 ? p : Vector3(0.5 * (p + q));
                device = target + 0.7 * (target - bone.object.proxy());
            } else {
                device += 0.0007 * test::random_vector(normal, generator);
            }
            if (tick % 500 == 499) device = Vector3(0.03, -0.02, 0.035);
            const double before = (bone.object.proxy() - device).norm();
            const Vector3 proxy = bone.follow(device);
            ASSERT_LT(std::abs(bone.winding(proxy)), 0.5) << "tick " << tick;
            ASSERT_GE(bone.distance(proxy), r * (1.0 - 1e-3)) << "tick " << tick;
            ASSERT_LE((proxy - device).norm(), before + 2.0 * r);
            inside += bone.winding(device) > 0.5 ? 1 : 0;
            held += (proxy - device).norm() > 1e-9 ? 1 : 0;
        }
        EXPECT_GT(inside, 100);
        EXPECT_GT(held, 300);
    }
}

TEST(GodObject, RestIsALocalMinimumOfTheDistanceToTheDevice) {
    // No nearby place outside is nearer to the device by more than the planes' own curvature explains.
    Bone bone(test::make_shaft(0.008, 0.03, 9, 0.01));
    std::mt19937_64 generator(5);
    std::normal_distribution<double> normal(0.0, 1.0);
    for (int trial = 0; trial < 60; ++trial) {
        bone.object.prepare(r);
        const double angle = 0.1 * trial;
        bone.follow(Vector3(0.02 * std::cos(angle), 0.02 * std::sin(angle), 0.02));
        const Vector3 device(0.004 * std::cos(angle + 0.3), 0.004 * std::sin(angle + 0.3), 0.021);
        Vector3 proxy;
        for (int i = 0; i < 30; ++i) proxy = bone.follow(device);
        const double reached = (proxy - device).norm();
        for (int probe = 0; probe < 200; ++probe) {
            const Vector3 place = proxy + 2e-5 * test::random_vector(normal, generator).normalized();
            if (bone.distance(place) < r) continue;
            EXPECT_GT((place - device).norm(), reached - 1e-8) << trial;
        }
    }
}

/// Pointed tool over a bone plate, at the given height of its tip over the plate's top from 5 ms on.
test::ClosedLoop pressed_tip(const std::string& method, double height, double thickness = 0.01) {
    return test::ClosedLoop(
        {test::LoopBody{.name = "tool",
                        .kind = BodyKind::instrument,
                        .mesh = test::make_shaft(0.0025, 0.06, 8, 0.01),
                        .offset = [=](double t) { return Vector3(0.0011, 0.0007, t < 0.0045 ? 0.002 : height); }},
         test::LoopBody{.name = "bone",
                        .mesh = box_mesh(Vector3(-0.02, -0.02, -thickness), Vector3(0.02, 0.02, 0), 5)}},
        method);
}

TEST(TipProxy, APressedTipGivesStiffnessTimesDepthOnceWhateverThePairs) {
    for (const char* method : {"god_object:k=1000", "thesis:k=1000", "thesis:profile=corrected,k=1000"}) {
        test::ClosedLoop loop = pressed_tip(method, -0.0008);
        for (int tick = 0; tick < 20; ++tick) ASSERT_TRUE(loop.step());
        EXPECT_GT(loop.contacts.pairs.size(), 4U);
        EXPECT_LT((loop.shown_force(0) - Vector3(0, 0, 0.8)).norm(), 1e-9) << method;
    }
}

TEST(TipProxy, ATipThatHasGoneThroughAThinPlateIsStillPushedBackThePathItCame) {
    for (const char* method : {"god_object:k=100", "thesis:k=100,mu=0"}) {
        test::ClosedLoop loop = pressed_tip(method, -0.009, 0.001);
        for (int tick = 0; tick < 20; ++tick) ASSERT_TRUE(loop.step());
        bool found = false;
        for (const ContactForceLaw& contact : loop.output.contacts) {
            const bool tip = contact.vertices[0] == 0 && std::abs(contact.gap + 0.009) < 1e-9;
            found = found || (tip && (contact.normal - Vector3::UnitZ()).norm() < 1e-9);
        }
        EXPECT_TRUE(found) << method;
    }
}

TEST(TipProxy, FreeTipAndSceneWithoutBoneHaveNone) {
    test::ClosedLoop free = pressed_tip("god_object", 0.0005);
    for (int tick = 0; tick < 20; ++tick) ASSERT_TRUE(free.step());
    EXPECT_TRUE(free.output.contacts.empty());
    test::PairSample s = test::vertex_of_a_in_b(BodyKind::instrument, BodyKind::tissue);
    s.respond("god_object:k=1000");
    EXPECT_EQ(s.output.contacts.size(), 1U);
}

TEST(TipProxy, LeavesMoreAndMoreOfAContactToOthersBetweenTwoAndFourRadiiOfTheTip) {
    // The smooth step 3 x² - 2 x³: 5/32 a quarter of the way, a half in the middle. The tip of a tool that is turned by
    // a right angle about z and moved.
    test::PairSample s = test::vertex_of_a_in_b(BodyKind::instrument, BodyKind::rigid);
    s.materials.tip[0] = Vector3(0.01, 0.02, 0.03);
    s.frame.pose.assign(2, {});
    s.frame.pose[0].translation = Vector3(0.001, 0.002, 0.003);
    s.frame.pose[0].rotation = Quaternion(Eigen::AngleAxisd(0.5 * std::numbers::pi, Vector3::UnitZ()));
    const Vector3 tip(-0.019, 0.012, 0.033);
    const Vector3 aside = Vector3(1.0, 2.0, -2.0) / 3.0;
    ContactLaws laws;
    laws.prepare(s.topology, s.materials, {});
    TipProxies proxies;
    proxies.prepare(s.topology, s.materials, r);
    EXPECT_EQ(proxies.share_left(0, tip), 1.0) << "before the first tick nothing is driven";
    proxies.respond(s.topology, s.materials, laws, s.frame, s.contacts, s.output);
    EXPECT_EQ(proxies.share_left(1, tip), 1.0) << "the tip is another body's";
    for (const auto& [radii, share] : {std::pair{0.0, 0.0},
                                       {1.99, 0.0},
                                       {2.5, 5.0 / 32.0},
                                       {3.0, 0.5},
                                       {3.5, 27.0 / 32.0},
                                       {4.01, 1.0},
                                       {100.0, 1.0}}) {
        const Vector3 place = tip + radii * r * aside;
        EXPECT_NEAR(proxies.share_left(0, place), share, 1e-9) << radii;
        Contact contact;
        contact.body_a = 0;
        contact.body_b = 1;
        contact.kind = ContactCase::edges_cross;
        contact.point = place;
        EXPECT_EQ(proxies.takes(s.topology, s.frame, contact), share == 0.0) << radii;
        contact.point = Vector3::Constant(1.0);
        contact.kind = ContactCase::a_enters_b;
        contact.vertex_a = 1;
        s.frame.position.col(1) = place;
        EXPECT_EQ(proxies.takes(s.topology, s.frame, contact), share == 0.0) << radii;
        contact.vertex_a = -1;
        contact.kind = ContactCase::point_face;
        contact.on_a = ContactPoint::at_vertex(1);
        EXPECT_EQ(proxies.takes(s.topology, s.frame, contact), share == 0.0) << radii;
    }
}

}  // namespace
}  // namespace trocar
