// Two triangles that meet, as bodies of any kind, with the intersection contact written by hand: the input of one
// triangle pair's response without any detector.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "contact/contact_set.hpp"
#include "contact/response_output.hpp"
#include "method/registry.hpp"
#include "scene/world.hpp"
#include "support/materials.hpp"
#include "support/meshes.hpp"
#include "support/reported_contacts.hpp"
#include "support/shown_force.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar::test {

/// Body a is triangle 0 (vertices 0-2), body b is triangle 1 (vertices 3-5).
struct PairSample {
    Topology topology;
    Materials materials;
    Frame frame;
    ContactSet contacts;
    ResponseOutput output;
    // Results of the last `step`:
    Frame before;
    Outcome outcome;
    std::vector<Wrench> load;  ///< per body, from contacts on tissue
    std::vector<ContactForce> contact_forces;

    PairSample(BodyKind kind_a, BodyKind kind_b, const Matrix3X& corners) {
        topology = make_topology({triangle_body("a", kind_a), triangle_body("b", kind_b)});
        frame.position = corners;
        frame.previous = corners;
        frame.velocity = Matrix3X::Zero(3, 6);
        materials = empty_materials(topology);
        for (std::size_t v = 0; v < 6; ++v) {
            if ((v < 3 ? kind_a : kind_b) != BodyKind::tissue) continue;
            materials.mass[v] = 1e-3;
            materials.mean_stiffness[v] = 220.0;
            materials.area[v] = 1e-5;
            materials.triangle_stiffness[v / 3] = 170.0;
        }
        output.resize(6, 2);
    }

    /// Calls the response and returns it. It must outlive the use of `output`, which may refer to the response's
    /// solver.
    std::unique_ptr<Response> respond(const std::string& method) {
        std::unique_ptr<Response> response = make_response(method);
        response->prepare(topology, materials);
        test::report_at_tick_start(topology, frame, contacts);
        response->respond(frame, dt, contacts, {}, output);
        return response;
    }
    /// Calls the response and advances the frame by one tick with the default stepper.
    void step(const std::string& method) {
        const std::unique_ptr<Response> response = respond(method);
        before = frame;
        MassSpring tissue(topology, materials);
        load.assign(2, {});
        outcome = tissue.advance(output, dt, frame, load);
        contact_forces.assign(tissue.contact_forces().begin(), tissue.contact_forces().end());
    }
    /// N, mean total force on a tissue vertex over the last `step`.
    [[nodiscard]] Vector3 force_on(Index vertex) const {
        return materials.mass[static_cast<std::size_t>(vertex)] / dt *
               (frame.velocity.col(vertex) - before.velocity.col(vertex));
    }
    /// N, on an instrument at the frame.
    [[nodiscard]] Vector3 shown_force(Index body) const { return test::shown_force(topology, frame, dt, output, body); }

private:
    static constexpr double dt = 1e-3;  // s
};

/// Two triangles in one contact, whose interval lies along x and whose vertex of a is the first.
inline PairSample in_contact(BodyKind kind_a, BodyKind kind_b, const Matrix3X& corners, Contact contact) {
    contact.a = 0;
    contact.b = 1;
    contact.vertex_a = 0;
    contact.interval_direction = Vector3::UnitX();
    PairSample sample(kind_a, kind_b, corners);
    sample.contacts.contacts = {contact};
    sample.contacts.pairs = {{0, 1}};
    return sample;
}

/// Face of body a is in the plane z = 0 (normal +z) around the origin; vertex 3, of body b, lies 0.5 mm below it.
inline PairSample vertex_of_b_in_a(BodyKind kind_a, BodyKind kind_b) {
    Matrix3X corners(3, 6);
    corners.col(0) = Vector3(0.0, 0.0, 0.0);
    corners.col(1) = Vector3(0.02, 0.0, 0.0);
    corners.col(2) = Vector3(0.0, 0.02, 0.0);
    corners.col(3) = Vector3(0.004, 0.005, -0.0005);
    corners.col(4) = Vector3(0.004, 0.006, 0.03);
    corners.col(5) = Vector3(0.007, 0.004, 0.03);
    Contact contact;
    contact.kind = ContactCase::b_enters_a;
    contact.point = corners.col(3);
    contact.normal = Vector3::UnitZ();
    contact.depth = 0.0005;
    contact.interval_length = 1e-4;
    contact.vertex_b = 3;
    return in_contact(kind_a, kind_b, corners, contact);
}

/// Face of body b is in the plane z = 0 (normal +z); vertex 0, of body a, lies 1.5 mm below it.
inline PairSample vertex_of_a_in_b(BodyKind kind_a, BodyKind kind_b) {
    Matrix3X corners(3, 6);
    corners.col(0) = Vector3(0.002, 0.003, -0.0015);
    corners.col(1) = Vector3(0.002, 0.004, 0.02);
    corners.col(2) = Vector3(0.003, 0.003, 0.02);
    corners.col(3) = Vector3(0.0, 0.0, 0.0);
    corners.col(4) = Vector3(0.01, 0.0, 0.0);
    corners.col(5) = Vector3(0.0, 0.01, 0.0);
    Contact contact;
    contact.kind = ContactCase::a_enters_b;
    contact.point = corners.col(0);
    contact.normal = -Vector3::UnitZ();
    contact.depth = 0.0015;
    contact.interval_length = 1e-4;
    contact.vertex_b = 3;
    return in_contact(kind_a, kind_b, corners, contact);
}

/// A library's own contact of vertex_of_a_in_b: 2 mm deep, without vertices.
inline Contact native_contact() {
    Contact native;
    native.a = 0;
    native.b = 1;
    native.point = Vector3(0.002, 0.003, -0.0007);
    native.normal = -Vector3::UnitZ();
    native.depth = 0.002;
    return native;
}

/// Crossing edges with an overlap of 0.125 m along +x (case 3.9-a of the data).
inline PairSample edges_crossing(BodyKind kind_a, BodyKind kind_b) {
    Matrix3X corners(3, 6);
    corners.col(0) = Vector3(0.0, -1.0, 0.0);
    corners.col(1) = Vector3(1.0, 1.0, 0.0);
    corners.col(2) = Vector3(-2.0, 1.0, 0.0);
    corners.col(3) = Vector3(0.375, 0.0, -1.0);
    corners.col(4) = Vector3(0.375, 0.0, 0.875);
    corners.col(5) = Vector3(4.0, 0.0, 0.0);
    Contact contact;
    contact.kind = ContactCase::edges_cross;
    contact.point = Vector3(0.4375, 0.0, 0.0);
    contact.normal = Vector3::UnitX();
    contact.depth = 0.125;
    contact.interval_length = 0.125;
    contact.vertex_b = 4;
    return in_contact(kind_a, kind_b, corners, contact);
}

}  // namespace trocar::test
