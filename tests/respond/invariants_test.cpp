// Invariants I12-I18 of METHODS §14 on prepared pairs and small sheets, each with the faithful or printed defect as
// witness, and every parameter of `thesis`: what it changes, on a case where it must.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <random>
#include <set>

#include "contact/derive.hpp"
#include "support/closed_loop.hpp"
#include "support/known_gap.hpp"
#include "support/random_vectors.hpp"
#include "support/reported_contacts.hpp"
#include "support/response_samples.hpp"
#include "support/scene_runs.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

using test::ClosedLoop;
using test::edges_crossing;
using test::LoopBody;
using test::make_shaft;
using test::make_sheet;
using test::PairSample;
using test::Shape;
using test::vertex_of_a_in_b;
using test::vertex_of_b_in_a;

struct Posed {
    const char* name;
    PairSample (*make)(BodyKind, BodyKind);
    BodyKind a;
    BodyKind b;
};
const std::array<Posed, 10> posed{{{"I2I vertex of b", vertex_of_b_in_a, BodyKind::instrument, BodyKind::instrument},
                                   {"I2I vertex of a", vertex_of_a_in_b, BodyKind::instrument, BodyKind::instrument},
                                   {"I2I edges", edges_crossing, BodyKind::instrument, BodyKind::instrument},
                                   {"I2R vertex of a", vertex_of_a_in_b, BodyKind::instrument, BodyKind::rigid},
                                   {"I2R edges", edges_crossing, BodyKind::instrument, BodyKind::rigid},
                                   {"I2T vertex of a", vertex_of_a_in_b, BodyKind::instrument, BodyKind::tissue},
                                   {"I2T vertex of b", vertex_of_b_in_a, BodyKind::instrument, BodyKind::tissue},
                                   {"I2T edges", edges_crossing, BodyKind::instrument, BodyKind::tissue},
                                   {"R2T vertex of b", vertex_of_b_in_a, BodyKind::rigid, BodyKind::tissue},
                                   {"R2T vertex of a", vertex_of_a_in_b, BodyKind::rigid, BodyKind::tissue}}};

// ------------------------------------------------------------ I12
/// Force of a contact on the tissue vertices that it pushes at the frame the response saw, N, by ContactForceLaw's
/// definition: at the end of the tick (1 ms) that begins with its gap and in which the script alone moves.
Vector3 force_on_pushed(const ContactForceLaw& contact, const Frame& frame) {
    const double speed = test::blend(contact.vertices, contact.weights, frame.velocity).dot(contact.normal);
    const double gap = contact.gap - contact.face_velocity * 1e-3;
    const double force = -contact.k * gap - contact.mu * (speed - contact.face_velocity);
    return (contact.adhesive ? force : std::max(force, 0.0)) * contact.normal;
}

TEST(ActionAndReaction, WhatTheToolShowsIsTheOppositeOfWhatTheOtherBodyTakes) {
    std::mt19937_64 generator(12);
    std::normal_distribution<double> normal(0.0, 0.1);
    int seen = 0;
    for (const char* method :
         {"thesis:n_back=0,mu=2", "thesis:profile=printed,n_back=0,mu=2", "thesis:profile=corrected,n_back=0,mu=2"}) {
        for (const Posed& one : posed) {
            if (one.a != BodyKind::instrument || one.b == BodyKind::rigid) continue;
            for (int i = 0; i < 100; ++i) {
                PairSample s = one.make(one.a, one.b);
                for (const int first : {0, 3}) {
                    const Vector3 velocity = test::random_vector(normal, generator);
                    for (int v = first; v < first + 3; ++v) s.frame.velocity.col(v) = velocity;
                }
                s.respond(method);
                if (!s.output.position_corrections.empty())
                    continue;  // 3.8 is faithful's, without a reaction (METHODS §13, 10)
                Vector3 other = Vector3::Zero();
                if (one.b == BodyKind::instrument) {
                    other = s.shown_force(1);
                } else {
                    for (const ContactForceLaw& contact : s.output.contacts) {
                        ASSERT_GE(contact.vertices[0], 3) << one.name << ": the tissue is what is pushed";
                        other += force_on_pushed(contact, s.frame);
                    }
                }
                const Vector3 tool = s.shown_force(0);
                EXPECT_LE((tool + other).norm(), 1e-12 * std::max(tool.norm(), other.norm()))
                    << one.name << " " << method;
                seen += tool.norm() > 1e-3 ? 1 : 0;
            }
        }
    }
    EXPECT_GT(seen, 500) << "forces were there to be compared";
}

// ------------------------------------------------------------ I13
/// Power that the dampers of all contacts give to the two surfaces, W: -mu v_n times v_n, with v_n from the frame's
/// velocities of both triangles at the contact and not from the response's own face velocity.
double damper_power(const PairSample& s, double& most) {
    double power = 0.0;
    for (const ContactForceLaw& contact : s.output.contacts) {
        const Vector3 pushed = test::blend(contact.vertices, contact.weights, s.frame.velocity);
        const bool a_is_pushed = contact.vertices[0] < 3;
        const Vector3 point = test::blend(contact.vertices, contact.weights, s.frame.position);
        const Corners other = corners_of(s.topology.triangles, s.frame.position, a_is_pushed ? 1 : 0);
        const Vector3 w = closest_point_on_triangle(other, point);
        Vector3 other_velocity = Vector3::Zero();
        for (int i = 0; i < 3; ++i) {
            other_velocity += w[i] * s.frame.velocity.col(s.topology.triangles(i, a_is_pushed ? 1 : 0));
        }
        const double closing = (pushed - other_velocity).dot(contact.normal);
        const double force = -contact.mu * (pushed.dot(contact.normal) - contact.face_velocity);
        power += force * closing;
        most = std::max(most, std::abs(force * closing));
    }
    return power;
}

TEST(ContactPower, DampersTakeEnergyInCorrectedAndFeedItIn36AsPrinted) {
    std::mt19937_64 generator(5);
    std::normal_distribution<double> normal(0.0, 0.1);
    double printed_most = 0.0;
    double seen = 0.0;
    for (const Posed& one : posed) {
        for (int i = 0; i < 200; ++i) {
            PairSample s = one.make(one.a, one.b);
            // Either surface moves as a whole, so that its speed is the same at vertex, edge and projection.
            for (const int first : {0, 3}) {
                if ((first == 0 ? one.a : one.b) == BodyKind::rigid) continue;
                const Vector3 velocity = test::random_vector(normal, generator);
                for (int v = first; v < first + 3; ++v) s.frame.velocity.col(v) = velocity;
            }
            s.respond("thesis:profile=corrected,n_back=0,mu=2");
            EXPECT_LE(damper_power(s, seen), 1e-12) << one.name;
            s.respond("thesis:n_back=0,mu=2");
            EXPECT_LE(damper_power(s, seen), 1e-12) << one.name << " faithful";
            s.respond("thesis:profile=printed,n_back=0,mu=2");
            if (std::string(one.name) == "I2T vertex of a") {
                double largest = 0.0;
                printed_most = std::max(printed_most, damper_power(s, largest));
            }
        }
    }
    EXPECT_GT(seen, 0.01) << "dampers were there to be judged";
    EXPECT_GT(printed_most, 0.01);
}

// ------------------------------------------------------------ I14
TEST(Projection, LeavesNoApproachAfter38And311) {
    std::mt19937_64 generator(6);
    std::normal_distribution<double> normal(0.0, 0.3);
    for (const BodyKind kind : {BodyKind::instrument, BodyKind::rigid}) {
        for (const char* method : {"thesis", "thesis:profile=printed", "thesis:profile=corrected,n_back=0"}) {
            for (int i = 0; i < 300; ++i) {
                PairSample s = vertex_of_b_in_a(kind, BodyKind::tissue);
                s.frame.velocity.col(3) = test::random_vector(normal, generator);
                Vector3 face = Vector3::Zero();
                if (kind == BodyKind::instrument) face = test::random_vector(normal, generator);
                for (int v = 0; v < 3; ++v) s.frame.velocity.col(v) = face;
                s.respond(method);
                ASSERT_EQ(s.output.position_corrections.size(), 1U);
                EXPECT_GE((s.output.position_corrections[0].velocity - face).z(), -1e-12) << method;
            }
        }
    }
}

// ------------------------------------------------------------ I15
/// 1/kg, of a contact whose point is this sum of vertices.
double mobility_of(const PairSample& s, const std::array<double, 6>& weight) {
    double sum = 0.0;
    for (std::size_t v = 0; v < 6; ++v) sum += weight.at(v) * weight.at(v) / s.materials.mass[v];
    return sum;
}

TEST(TissueTissue, EachApplicationKeepsMomentumAndNeverAddsEnergy) {
    std::mt19937_64 generator(7);
    std::normal_distribution<double> normal(0.0, 0.3);
    double lost = 0.0;
    for (const char* method : {"thesis", "thesis:profile=corrected,n_back=0"}) {
        const bool faithful = std::string(method) == "thesis";
        for (int i = 0; i < 500; ++i) {
            PairSample s = vertex_of_b_in_a(BodyKind::tissue, BodyKind::tissue);
            for (int v = 0; v < 6; ++v) {
                s.materials.mass[static_cast<std::size_t>(v)] = 1e-3 * (1.0 + 0.3 * v);
                s.frame.velocity.col(v) = test::random_vector(normal, generator);
            }
            s.respond(method);
            Vector3 momentum = Vector3::Zero();
            double energy = 0.0;
            for (const PositionCorrection& position_correction : s.output.position_corrections) {
                const double m = s.materials.mass[static_cast<std::size_t>(position_correction.vertex)];
                const Vector3 before = s.frame.velocity.col(position_correction.vertex);
                momentum += m * (position_correction.velocity - before);
                energy += 0.5 * m * (position_correction.velocity.squaredNorm() - before.squaredNorm());
            }
            EXPECT_LT(momentum.norm(), 1e-15) << method;
            if (faithful) {
                EXPECT_NEAR(energy, 0.0, 1e-15);
                continue;
            }
            EXPECT_LE(energy, 1e-15);
            lost = std::max(lost, -energy);
            // Between the vertex and the point of the face over it, whose corners share the impulse by their weights.
            constexpr std::array<double, 6> weight{-0.55, -0.2, -0.25, 1.0, 0.0, 0.0};
            double before = 0.0;
            double after = 0.0;
            for (int v = 0; v < 6; ++v) before += weight.at(at(v)) * s.frame.velocity(2, v);
            EXPECT_EQ(s.output.position_corrections.empty(), before >= 0.0) << "what parts is left alone";
            after = before;
            for (const PositionCorrection& one : s.output.position_corrections) {
                const double gained = one.velocity.z() - s.frame.velocity(2, one.vertex);
                after += weight.at(at(one.vertex)) * gained;
                const double impulse = s.materials.mass[at(one.vertex)] * gained / weight.at(at(one.vertex));
                EXPECT_NEAR(impulse * mobility_of(s, weight), -1.2 * before, 1e-12);
            }
            EXPECT_NEAR(after, before < 0.0 ? -0.2 * before : before, 1e-12);
        }
    }
    EXPECT_GT(lost, 1e-6) << "restitution of 0.2 takes something";
}

// ------------------------------------------------------------ I16
TEST(Rest, WithoutDepthAndSpeedThereIsNoForceInAnyProfile) {
    for (const char* method :
         {"thesis", "thesis:profile=printed", "thesis:profile=corrected", "thesis:profile=corrected,n_back=0"}) {
        for (const Posed& one : posed) {
            PairSample s = one.make(one.a, one.b);
            // The entering vertex, or the crossing edges, are brought to exact touch.
            if (one.make == vertex_of_b_in_a) s.frame.position(2, 3) = 0.0;
            if (one.make == vertex_of_a_in_b) s.frame.position(2, 0) = 0.0;
            Contact& contact = s.contacts.contacts[0];
            if (contact.kind == ContactCase::edges_cross) {
                s.frame.position.middleCols(3, 3).colwise() += contact.depth * contact.normal;
            }
            s.frame.previous = s.frame.position;
            contact.depth = 0.0;
            contact.interval_length = 0.0;
            s.respond(method);
            constexpr double rounding = 1e-12;  // N, of 1e5 N/m times what lines of 10 mm are off by
            for (const ContactForceLaw& linear : s.output.contacts) {
                EXPECT_NEAR(linear.k * linear.gap, 0.0, rounding) << one.name;
            }
            for (Index body = 0; body < s.topology.body_count(); ++body) {
                if (s.topology.bodies[static_cast<std::size_t>(body)].kind != BodyKind::instrument) continue;
                EXPECT_LE(s.shown_force(body).norm(), rounding) << method << ' ' << one.name;
            }
            for (const Wrench& wrench : s.output.wrench) EXPECT_EQ(wrench.force.norm(), 0.0);
            for (const PositionCorrection& position_correction : s.output.position_corrections) {
                EXPECT_EQ(position_correction.position, Vector3(s.frame.position.col(position_correction.vertex)))
                    << one.name;
                EXPECT_EQ(position_correction.velocity.norm(), 0.0);
            }
        }
    }
}

// ------------------------------------------------------------ I17
/// Largest change of the force on the tool from one place to the next, relative to the force, while a point 0.4 mm
/// below a sheet slides 1.6 mm in steps of `step`. The sheet is wavy, or two slopes that meet at x = 0 in a ridge (fold
/// < 0) or a valley.
double roughness(const std::string& method, double step, double start_x, double fold = 0.0) {
    Shape sheet = make_sheet(8, 0.005);
    for (Vector3& p : sheet.vertices) {
        p.z() = fold == 0.0 ? 0.0008 * std::sin(300.0 * p.x()) * std::cos(260.0 * p.y() + 0.4) : fold * std::abs(p.x());
    }
    ClosedLoop loop = test::tool_on_tissue(make_shaft(0.0002, 0.02, 4, 0.018), {}, sheet, method);
    const Matrix3X start = loop.frame.position;
    const Range tool = loop.topology.bodies[0].vertices;
    Vector3 last = Vector3::Zero();
    double worst = 0.0;
    const auto detector = make_detector("brute_force");
    detector->prepare(loop.topology, loop.frame);
    const int steps = static_cast<int>(0.0016 / step);  // below the two seconds after which it would be given up
    for (int i = -2; i <= steps; ++i) {
        const double x = start_x + step * std::max(i, 0);
        const double y = 0.0016 + 0.37 * step * std::max(i, 0);
        loop.frame.position = start;
        // It comes from above first, so that it is known to belong there.
        const double z =
            i == -2 ? 0.004 : test::heights_at(loop, loop.topology.bodies[1].triangles, {x, y, 0.0}).at(0) - 0.0004;
        loop.frame.position.middleCols(tool.first, tool.count).colwise() += Vector3(x, y, z);
        loop.frame.previous = loop.frame.position;
        loop.frame.velocity.setZero();
        ContactSet contacts;
        detector->update(loop.frame, 0.0);
        detector->detect(loop.frame, contacts);
        derive(loop.topology, loop.frame, contacts);
        test::report_at_tick_start(loop.topology, loop.frame, contacts);
        loop.response().respond(loop.frame, 1e-3, contacts, {}, loop.output);
        Vector3 force = Vector3::Zero();
        for (const ContactForceLaw& contact : loop.output.contacts) {
            force -= std::max(0.0, -contact.k * contact.gap) * contact.normal;
        }
        if (i > 0) {
            EXPECT_GT(last.norm(), 0.0) << method << " at step " << i;
            worst = std::max(worst, (force - last).norm() / last.norm());
        }
        last = force;
    }
    return worst;
}

TEST(Continuity, GapCorrectedForceHasNoJumpAcrossEdgesAndFaithfulHas) {
    test::expect_known_gap(
        "intersection contacts change from a vertex in a face to edges that cross, and the force of corrected with "
        "them",
        [] {
            // A continuous force changes ten times less over a ten times smaller step; a jump does not.
            for (const double start : {-0.0008, 0.0013}) {  // across the edge x = 0, across a diagonal
                const double corrected = roughness("thesis:profile=corrected", 1e-5, start);
                const double corrected_finer = roughness("thesis:profile=corrected", 1e-6, start);
                EXPECT_LT(corrected_finer, std::max(0.2 * corrected, 1e-12));
                EXPECT_LT(corrected_finer, 0.02);
                const double faithful = roughness("thesis:n_back=0", 1e-5, start);
                const double faithful_finer = roughness("thesis:n_back=0", 1e-6, start);
                EXPECT_GT(faithful_finer, 0.05);
                EXPECT_GT(faithful_finer, 0.5 * faithful);
            }
        });
}

TEST(Continuity, GapCorrectedForceTurnsOverARidgeAndGrowsInAValleyWithoutAJump) {
    test::expect_known_gap("as across an edge", [] {
        for (const double fold : {-0.1, -0.27, 0.1}) {  // turns of 11 and 30 degrees
            const double coarse = roughness("thesis:profile=corrected", 1e-5, -0.0008, fold);
            const double finer = roughness("thesis:profile=corrected", 1e-6, -0.0008, fold);
            EXPECT_GT(coarse, 1e-4) << "the force does change, fold " << fold;
            EXPECT_LT(finer, 0.2 * coarse) << "fold " << fold;
            EXPECT_LT(finer, 0.02) << "fold " << fold;
            EXPECT_GT(roughness("thesis:n_back=0", 1e-6, -0.0008, fold), 0.05) << "fold " << fold;
        }
    });
}

// ------------------------------------------------------------ I18
/// Sum of the contact stiffness, N/m, between a flat plate 0.5 mm below a sheet's plane and the sheet, with the
/// plate's cells of the given number.
double total_stiffness(const std::string& method, int cells) {
    // Upside down: the vertices of its first 2 n² triangles enter the sheet's faces from above.
    Shape plate = test::slab(0.012, 0.01, cells).rotate(Vector3::UnitX(), std::numbers::pi);
    for (Vector3& p : plate.vertices)
        p += Vector3(0.0011, 0.0007, -0.0005 + 1e-5 * std::sin(900.0 * p.x() + 700.0 * p.y()));
    ClosedLoop loop({LoopBody{.name = "plate", .kind = BodyKind::instrument, .mesh = plate},
                     LoopBody{.name = "sheet", .kind = BodyKind::tissue, .closed = false, .mesh = make_sheet(8, 0.01)}},
                    method);
    // All pairs of a plate triangle and the sheet triangle above it, each with the plate's deepest vertex in the face.
    ContactSet contacts;
    for (Index t = 0; t < 2 * cells * cells; ++t) {
        const Vector3 x = loop.frame.position.col(loop.topology.triangles(0, t));
        const Range sheet = loop.topology.bodies[1].triangles;
        for (Index face = sheet.first; face < sheet.end(); ++face) {
            const Corners c = corners_of(loop.topology.triangles, loop.frame.position, face);
            const Vector3 w = closest_point_on_triangle(c, x);
            if ((w[0] * c[0] + w[1] * c[1] + w[2] * c[2] - x).head<2>().norm() > 1e-12) continue;
            Contact contact;
            contact.a = t;
            contact.b = face;
            contact.kind = ContactCase::a_enters_b;
            contact.point = x;
            contact.normal = -Vector3::UnitZ();
            contact.depth = -x.z();
            contact.vertex_a = loop.topology.triangles(0, t);
            contact.vertex_b = loop.topology.triangles(0, face);
            contacts.contacts.push_back(contact);
            contacts.pairs.push_back({t, face});
            break;
        }
    }
    test::report_at_tick_start(loop.topology, loop.frame, contacts);
    loop.response().respond(loop.frame, 1e-3, contacts, {}, loop.output);
    double sum = 0.0;
    for (const ContactForceLaw& contact : loop.output.contacts) sum += contact.k;
    return sum;
}

TEST(Refinement, TotalStiffnessStaysInCorrectedAndGrowsFourfoldInFaithful) {
    const double area = total_stiffness("thesis:profile=corrected,n_back=0", 12);
    const double finer = total_stiffness("thesis:profile=corrected,n_back=0", 24);
    EXPECT_NEAR(finer / area, 1.0, 0.1);
    const double pairs = total_stiffness("thesis:n_back=0", 12);
    EXPECT_NEAR(total_stiffness("thesis:n_back=0", 24) / pairs, 4.0, 0.4);
}

// ------------------------------------------------------------ every parameter
/// Something about a posed pair after `prepare`.
std::function<double(const std::string&)> measured(PairSample (*make)(BodyKind, BodyKind), BodyKind a, BodyKind b,
                                                   const std::function<void(PairSample&)>& prepare,
                                                   const std::function<double(const PairSample&)>& measure) {
    return [=](const std::string& method) {
        PairSample s = make(a, b);
        prepare(s);
        s.respond(method);
        return measure(s);
    };
}
/// Force on body `body`.
std::function<double(const std::string&)> tip(PairSample (*make)(BodyKind, BodyKind), BodyKind a, BodyKind b,
                                              const std::function<void(PairSample&)>& prepare, Index body) {
    return measured(make, a, b, prepare, [body](const PairSample& s) { return s.shown_force(body).norm(); });
}

/// Something about the last of `ticks` ticks of a needle driven 6 mm into a wavy sheet.
std::function<double(const std::string&)> stabbed(int ticks, const std::function<double(const ClosedLoop&)>& measure) {
    return [=](const std::string& method) {
        Shape sheet = make_sheet(8, 0.005);
        for (Vector3& p : sheet.vertices) p.z() = 0.0006 * std::sin(300.0 * p.x()) * std::cos(260.0 * p.y() + 0.4);
        ClosedLoop loop = test::tool_on_tissue(
            make_shaft(0.0025, 0.06, 8, 0.01),
            [](double t) { return Vector3(0.0011, 0.0007, std::max(0.002 - 1.1 * t, -0.006)); }, sheet, method);
        for (int tick = 0; tick < ticks; ++tick) EXPECT_TRUE(loop.step()) << loop.outcome.message;
        return measure(loop);
    };
}
double tissue_height(const ClosedLoop& loop) {
    return loop.frame.position.rightCols(loop.topology.bodies[1].vertices.count).row(2).sum();
}

/// Height of a sheet that a closing tool lifts.
double lifted(const std::string& method) {
    const auto offset = [](double t) {
        return Vector3(0.0001, 0.0002, -0.0003 + 0.004 * std::clamp((t - 0.03) / 0.1, 0.0, 1.0));
    };
    ClosedLoop loop = test::tool_on_tissue(make_shaft(0.0012, 0.03, 6, 0.006), offset, make_sheet(8, 0.005), method);
    for (int tick = 0; tick < 100; ++tick) {
        loop.set_jaw(0, tick < 20 ? 1.0 : 0.0);
        EXPECT_TRUE(loop.step()) << loop.outcome.message;
    }
    return tissue_height(loop);
}

/// How hard surfaces attract a tool that has just gone 3 mm through a sheet at half a millimetre a tick, N.
double attraction(const std::string& method) {
    const auto offset = [](double t) { return Vector3(0.0011, 0.0007, -0.003 - 0.5 * (t - 1e-3)); };
    ClosedLoop loop = test::tool_on_tissue(make_shaft(0.0025, 0.06, 8, 0.01), offset, make_sheet(10, 0.005), method);
    EXPECT_TRUE(loop.step()) << loop.outcome.message;
    double sum = 0.0;
    for (const ContactForceLaw& contact : loop.output.contacts) {
        if (contact.vertices[1] < 0) sum += contact.k * std::abs(contact.gap);
    }
    return sum;
}

/// Sum of the tool's force, N, over the first ticks of the shipped scene whose jaws lift a fold.
double grasped_force(const std::string& method) {
    const Scene scene = test::shipped_scene("i2t_grasp");
    double sum = 0.0;
    for (const StepRow& row : test::run_scene_with(scene, method, 100, 700).rows) sum += row.tool_force.norm();
    return sum;
}

struct Setting {
    std::string name;
    std::string base;     ///< method without the setting
    std::string flipped;  ///< its value instead of the base's
    std::string what;     ///< what changes
    std::function<double(const std::string&)> measure;
};

void PrintTo(const Setting& one, std::ostream* out) { *out << one.base << " with " << one.name << "=" << one.flipped; }

std::vector<Setting> settings() {
    const auto instrument = BodyKind::instrument;
    const auto tissue = BodyKind::tissue;
    const auto rigid = BodyKind::rigid;
    const auto none = [](PairSample&) {};
    const auto contacts = [](const PairSample& s) { return static_cast<double>(s.output.contacts.size()); };
    const auto speed = [](PairSample& s) { s.frame.velocity.col(0) = Vector3(0, 0, -0.2); };
    const auto sinking = [](PairSample& s) { s.frame.velocity.col(3) = Vector3(0, 0, -0.4); };
    const auto placed = [](const PairSample& s) {
        double sum = 0.0;
        for (const PositionCorrection& p : s.output.position_corrections)
            sum += p.velocity.z() + 1e3 * p.position.norm();
        return sum;
    };
    const auto springs = [](PairSample& s) {
        s.frame.velocity.col(3) = Vector3(0, 0, -0.4);
        s.frame.position.col(4) = Vector3(0.004, 0.005, -0.05);
        s.materials.springs = {Spring{.i = 3, .j = 4, .rest = 0.04, .k = 40.0}};
    };
    return {
        {"profile", "thesis:mu=0.5,n_back=0", "printed", "sign of the damper on the tool",
         tip(vertex_of_a_in_b, instrument, tissue, speed, 0)},
        {"k", "thesis:n_back=0", "123", "force on the tool", tip(vertex_of_a_in_b, instrument, tissue, none, 0)},
        {"mu", "thesis:n_back=0", "0.7", "force on a moving tool", tip(vertex_of_a_in_b, instrument, tissue, speed, 0)},
        {"relaxation_time", "thesis:k=100,n_back=0", "0.1", "force on a moving tool",
         tip(vertex_of_a_in_b, instrument, tissue, speed, 0)},
        {"look_ahead", "thesis:profile=corrected", "scripts", "force on two jaws that lift a fold", grasped_force},
        {"distribute", "thesis", "force_at_vertex", "weight of the first loaded vertex",
         measured(vertex_of_a_in_b, instrument, tissue, none,
                  [](const PairSample& s) { return s.output.contacts.at(0).weights[0]; })},
        {"profile", "thesis:n_back=0", "corrected", "contacts of a vertex that two pairs report",
         measured(
             vertex_of_a_in_b, instrument, tissue,
             [](PairSample& s) { s.contacts.contacts.push_back(s.contacts.contacts[0]); }, contacts)},
        {"profile", "thesis:n_back=0", "corrected", "stiffness of the contact",
         measured(vertex_of_a_in_b, instrument, tissue, none,
                  [](const PairSample& s) { return s.output.contacts.at(0).k; })},
        {"profile", "thesis:k=100,mu=2", "corrected", "pull on a tool that leaves fast",
         tip(
             vertex_of_b_in_a, instrument, instrument, [](PairSample& s) { s.frame.velocity(2, 3) = 0.85; }, 1)},
        {"profile", "thesis", "corrected", "place of a still tissue vertex under a moving face",
         measured(vertex_of_b_in_a, instrument, tissue, none, placed)},
        {"profile", "thesis", "corrected", "force on the tool that stops a vertex on a spring",
         tip(vertex_of_b_in_a, instrument, tissue, springs, 0)},
        {"profile", "thesis:n_back=0", "corrected", "a bone's vertex in a tissue face acts",
         measured(vertex_of_a_in_b, rigid, tissue, none, contacts)},
        {"profile", "thesis", "corrected", "speeds after the impact",
         measured(vertex_of_b_in_a, tissue, tissue, sinking, placed)},
        {"profile", "thesis", "corrected", "the tissue that a closing tool lifts", lifted},
        {"n_back", "thesis", "0", "the tissue after a stab", stabbed(30, tissue_height)},
        {"n_back", "thesis:profile=corrected", "0", "the tissue after a stab", stabbed(30, tissue_height)},
        {"n_back", "thesis", "1", "how far back surfaces attract the tool", attraction},
        {"l_max", "thesis", "0.0005", "how far back surfaces attract the tool", attraction},
        {"contacts", "thesis", "explicit", "the tissue after a stab", stabbed(12, tissue_height)},
        {"contacts", "thesis", "zero_order_hold", "the tissue after a stab", stabbed(12, tissue_height)},
    };
}

class ThesisSetting : public testing::TestWithParam<Setting> {};

TEST_P(ThesisSetting, ChangesWhatItSays) {
    const Setting& tested = GetParam();
    const std::string join = tested.base.find(':') == std::string::npos ? ":" : ",";
    const double before = tested.measure(tested.base);
    const double after = tested.measure(tested.base + join + tested.name + "=" + tested.flipped);
    ASSERT_TRUE(std::isfinite(before) && std::isfinite(after));
    EXPECT_GT(std::abs(after - before), 1e-9 * std::max({std::abs(before), std::abs(after), 1e-3}))
        << tested.name << "=" << tested.flipped << " on " << tested.base << " should change " << tested.what;
}

INSTANTIATE_TEST_SUITE_P(Settings, ThesisSetting, testing::ValuesIn(settings()),
                         [](const auto& tested) { return tested.param.name + "_" + std::to_string(tested.index); });

TEST(ThesisSettings, EveryParameterIsHeldToSomething) {
    std::set<std::string> held;
    for (const Setting& one : settings()) held.insert(one.name);
    for (const Parameter& parameter : registry().response("thesis").parameters) {
        EXPECT_TRUE(held.contains(parameter.name)) << parameter.name << " changes nothing that a test knows of";
    }
}

}  // namespace
}  // namespace trocar
