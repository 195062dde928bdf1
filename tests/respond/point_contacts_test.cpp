// What plain methods receive as a contact, from the definition of its kind.
#include "respond/point_contacts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "support/shapes.hpp"

namespace trocar {
namespace {

/// Two triangles of two bodies, 1 mm apart along z: vertices 0 to 2 and 3 to 5.
test::World two_triangles() {
    const auto at_height = [](double z) { return test::triangle({0.0, 0.0, z}, {0.004, 0.0, z}, {0.0, 0.004, z}); };
    return test::make_world("two", {{BodyKind::tissue, at_height(0.0)}, {BodyKind::instrument, at_height(0.001)}});
}

/// Inside by 0.3 mm when the tick begins, and 0.2 mm more by what the scripts move in it.
Contact between_features(ContactCase kind, const ContactPoint& on_a, const ContactPoint& on_b) {
    Contact contact;
    contact.kind = kind;
    contact.body_a = 0;
    contact.body_b = 1;
    contact.on_a = on_a;
    contact.on_b = on_b;
    contact.normal = Vector3::UnitZ();
    contact.gap = -0.0003;
    contact.approach = -0.0002;
    contact.id = 17;
    return contact;
}

TEST(PointContacts, FeaturesAreReportedAtTheirOwnPlacesAsDeepAsTheTickWillMakeThem) {
    const test::World world = two_triangles();
    PointContacts points;
    points.prepare(world.topology);
    const ContactPoint edge_a{{0, 1, -1}, {0.3, 0.7, 0.0}};
    const ContactPoint edge_b{{4, 5, -1}, {0.2, 0.8, 0.0}};
    const ContactPoint face_a{{0, 1, 2}, {0.5, 0.3, 0.2}};
    struct Case {
        ContactCase kind;
        ContactPoint on_a, on_b;
        bool of_vertex;
        Index vertex;  ///< that stands for it: the entering one, else the most loaded of b
        Index other;
    };
    for (const Case& one : {Case{ContactCase::edge_edge, edge_a, edge_b, false, 5, 0},
                            Case{ContactCase::point_face, ContactPoint::at_vertex(2), edge_b, true, 2, 1},
                            Case{ContactCase::point_face, face_a, ContactPoint::at_vertex(3), true, 3, 0}}) {
        ContactSet contacts;
        contacts.contacts = {between_features(one.kind, one.on_a, one.on_b)};
        for (const bool reduce : {false, true}) {
            ResponseOutput output;
            points.gather(world.topology, world.frame, contacts, reduce, output);
            ASSERT_EQ(output.all_skipped(), 0);
            ASSERT_EQ(points.list().size(), 1U);
            const PointContact& reported = points.list()[0];
            EXPECT_NEAR(reported.depth, 0.0005, 1e-15);
            EXPECT_NEAR(reported.distance, 0.0003, 1e-15);
            EXPECT_EQ(reported.normal, Vector3(Vector3::UnitZ()));
            EXPECT_EQ(reported.of_vertex, one.of_vertex);
            EXPECT_EQ(reported.vertex, one.vertex);
            EXPECT_EQ(reported.other, one.other);
            EXPECT_EQ(reported.body_a, 0);
            EXPECT_EQ(reported.body_b, 1);
            EXPECT_EQ(reported.a.vertices, one.on_a.vertices);
            EXPECT_EQ(reported.a.weights, one.on_a.weights);
            EXPECT_EQ(reported.b.vertices, one.on_b.vertices);
            EXPECT_EQ(reported.b.weights, one.on_b.weights);
            EXPECT_EQ(reported.id, 17U);
        }
    }
}

TEST(PointContacts, AnOpenContactHasANegativeDepthAndOneWithoutANormalHasNoPlace) {
    const test::World world = two_triangles();
    PointContacts points;
    points.prepare(world.topology);
    ContactSet contacts;
    for (const ContactCase kind : {ContactCase::edge_edge, ContactCase::point_face}) {
        const Contact deep = between_features(kind, ContactPoint::at_vertex(0), ContactPoint::at_vertex(3));
        Contact open = deep;
        open.gap = 0.001;
        Contact grazing = deep;  // open as the tick begins, just touching when it ends
        grazing.gap = -grazing.approach;
        Contact unknown = deep;
        unknown.normal.setConstant(Contact::unset);
        Contact deepless = deep;
        deepless.gap = Contact::unset;
        for (const Contact& one : {deep, open, grazing, unknown, deepless}) contacts.contacts.push_back(one);
    }
    for (const ContactCase kind : {ContactCase::touch, ContactCase::coplanar, ContactCase::degenerate}) {
        Contact other = between_features(kind, ContactPoint::at_vertex(0), ContactPoint::at_vertex(3));
        other.a = 0;
        other.b = 1;
        contacts.contacts.push_back(other);
    }
    ResponseOutput output;
    points.gather(world.topology, world.frame, contacts, false, output);
    EXPECT_EQ(output.skipped_for(SkipReason::no_direction), 2 * 2 + 3);
    EXPECT_EQ(output.skipped_for(SkipReason::reduced), 0);
    ASSERT_EQ(points.list().size(), 6U);
    const double approach = contacts.contacts[0].approach;
    for (const std::size_t open : {1U, 4U}) EXPECT_NEAR(points.list()[open].depth, -(0.001 + approach), 1e-15);
    for (const std::size_t grazing : {2U, 5U}) EXPECT_EQ(points.list()[grazing].depth, 0.0);
}

TEST(PointContacts, AReductionTakesClosedContactsAlone) {
    const test::World world = two_triangles();
    PointContacts points;
    points.prepare(world.topology);
    // Five faces of one vertex: two closed ones, of which the deepest stays, and three open ones, which all stay.
    ContactSet contacts;
    for (const double gap : {-0.0003, -0.0002, 0.002, 0.003, 0.001}) {
        Contact one = between_features(ContactCase::point_face, ContactPoint::at_vertex(0), ContactPoint::at_vertex(3));
        one.approach = 0.0;
        one.gap = gap;
        contacts.contacts.push_back(one);
    }
    for (int order = 0; order < 2; ++order) {
        ResponseOutput output;
        points.gather(world.topology, world.frame, contacts, true, output);
        EXPECT_EQ(output.skipped_for(SkipReason::reduced), 1);
        ASSERT_EQ(points.list().size(), 4U);
        std::vector<double> these;
        for (const PointContact& one : points.list()) these.push_back(one.depth);
        std::sort(these.begin(), these.end());
        EXPECT_EQ(these, (std::vector<double>{-0.003, -0.002, -0.001, 0.0003}));
        std::reverse(contacts.contacts.begin(), contacts.contacts.end());
    }
}

}  // namespace
}  // namespace trocar
