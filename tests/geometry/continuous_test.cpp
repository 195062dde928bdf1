#include "geometry/continuous.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "geometry/exact.hpp"
#include "geometry/triangle_distance.hpp"
#include "support/data.hpp"
#include "support/random_vectors.hpp"
#include "support/test_name.hpp"

namespace trocar {
namespace {

MovingPoint still(const Vector3& p) { return {p, p}; }
MovingPoint moving(const Vector3& from, const Vector3& to) { return {from, to}; }
Vector3 at(const MovingPoint& p, double t) { return (1.0 - t) * p.start + t * p.end; }

const MovingTriangle face{still({0, 0, 0}), still({4, 0, 0}), still({0, 4, 0})};

TEST(VertexFace, ThroughAStillFaceMeetsAtTheKnownTime) {
    EXPECT_EQ(first_contact(moving({1, 1, 1}, {1, 1, -3}), face), 0.25);
    EXPECT_EQ(first_contact(moving({1, 1, 0}, {1, 1, -3}), face), 0.0);
    EXPECT_EQ(first_contact(moving({1, 1, 3}, {1, 1, 0}), face), 1.0);
    EXPECT_EQ(first_contact(moving({1, 1, 3}, {1, 1, 1e-300}), face), std::nullopt);
    EXPECT_EQ(first_contact(moving({3, 3, 1}, {3, 3, -3}), face), std::nullopt);
    const std::optional<double> third = first_contact(moving({1, 1, 1}, {1, 1, -2}), face);
    ASSERT_TRUE(third);
    EXPECT_EQ(*third, std::floor(std::ldexp(1.0, 53) / 3.0) / std::ldexp(1.0, 53));
}

TEST(VertexFace, EdgesAndCornersBelongToTheFace) {
    EXPECT_EQ(first_contact(moving({2, 2, 1}, {2, 2, -1}), face), 0.5);
    EXPECT_EQ(first_contact(moving({4, 0, 1}, {4, 0, -1}), face), 0.5);
    EXPECT_EQ(first_contact(moving({0, 2, 1}, {0, 2, -1}), face), 0.5);
    const double past = std::nextafter(2.0, 3.0);
    EXPECT_EQ(first_contact(moving({2, past, 1}, {2, past, -1}), face), std::nullopt);
}

TEST(VertexFace, MotionInThePlaneOfTheFaceEntersThroughAnEdge) {
    EXPECT_EQ(first_contact(moving({-1, 1, 0}, {3, 1, 0}), face), 0.25);
    EXPECT_EQ(first_contact(moving({-1, 0, 0}, {3, 0, 0}), face), 0.25);  // along the line of an edge
    EXPECT_EQ(first_contact(moving({-1, -1, 0}, {3, -1, 0}), face), std::nullopt);
    EXPECT_EQ(first_contact(moving({1, 1, 0}, {9, 9, 0}), face), 0.0);
    EXPECT_EQ(first_contact(still({1, 1, 0}), face), 0.0);
    EXPECT_EQ(first_contact(still({1, 1, 1}), face), std::nullopt);
    EXPECT_EQ(first_contact(still({3, 3, 0}), face), std::nullopt);
}

TEST(VertexFace, FaceThatCollapsesToASegmentIsMetThere) {
    // Both free corners move towards x = 0 and on: at t = 1/2 the face is the segment from (0,0,0) to (0,4,0).
    const MovingTriangle folding{still({0, 0, 0}), moving({2, 2, 1}, {-2, 2, -1}), still({0, 4, 0})};
    EXPECT_EQ(first_contact(still({0, 3, 0}), folding), 0.0);  // on its edge all the time
    EXPECT_EQ(first_contact(still({0, 5, 0}), folding), std::nullopt);
    const MovingTriangle point{moving({1, 0, 0}, {-1, 0, 0}), moving({0, 1, 0}, {0, -1, 0}),
                               moving({0, 0, 1}, {0, 0, -1})};
    EXPECT_EQ(first_contact(still({0, 0, 0}), point), 0.5);  // all corners meet in the vertex
}

TEST(VertexFace, TwoPassesReportTheFirst) {
    // The face's corner swings: coplanar twice, z = (1 - 4t)(…): the vertex rises and the face tilts past it.
    const MovingTriangle tilting{still({-4, -4, 0}), still({4, -4, 0}), moving({0, 4, 8}, {0, 4, -8})};
    // Height of the face over the origin is 4 (1 - 2t), 1 at t = 3/8.
    EXPECT_EQ(first_contact(still({0, 0, 1}), tilting), 0.375);
}

TEST(EdgeEdge, CrossesAtTheKnownTime) {
    const MovingEdge along_x{still({-1, 0, 0}), still({1, 0, 0})};
    const auto along_y = [](double from, double to, double x = 0.0) {
        return MovingEdge{moving({x, -1, from}, {x, -1, to}), moving({x, 1, from}, {x, 1, to})};
    };
    EXPECT_EQ(first_contact(along_x, along_y(1, -3)), 0.25);
    EXPECT_EQ(first_contact(along_x, along_y(1, -3, 1.0)), 0.25);
    EXPECT_EQ(first_contact(along_x, along_y(1, -3, std::nextafter(1.0, 2.0))), std::nullopt);
    EXPECT_EQ(first_contact(along_x, along_y(1, 0)), 1.0);
    EXPECT_EQ(first_contact(along_x, along_y(1, 1e-200)), std::nullopt);
}

TEST(EdgeEdge, ParallelAndCollinearEdgesMeet) {
    const MovingEdge along_x{still({-1, 0, 0}), still({1, 0, 0})};
    const auto also_x = [](const Vector3& from, const Vector3& to) {
        const Vector3 half(0.5, 0, 0);
        return MovingEdge{moving(from - half, to - half), moving(from + half, to + half)};
    };
    EXPECT_EQ(first_contact(along_x, also_x({0, 0, 1}, {0, 0, -3})), 0.25);
    EXPECT_EQ(first_contact(along_x, also_x({2.5, 0, 0}, {0.5, 0, 0})), 0.5);
    EXPECT_EQ(first_contact(along_x, also_x({1.5, 0, 1}, {1.5, 0, -1})), 0.5);  // touches in the end points
    EXPECT_EQ(first_contact(along_x, also_x({1.75, 0, 1}, {1.75, 0, -1})), std::nullopt);
    EXPECT_EQ(first_contact(along_x, also_x({5, 0, 0}, {3, 0, 0})), std::nullopt);
    const MovingEdge point{moving({0, 0, 1}, {0, 0, -1}), moving({0, 0, 1}, {0, 0, -1})};
    EXPECT_EQ(first_contact(along_x, point), 0.5);
}

TEST(MovingTriangles, PassThroughEachOtherWithinATickUnseenAtItsEnds) {
    const auto shifted = [](double from, double to) {
        MovingTriangle t;
        const std::array<Vector3, 3> corners{Vector3(1, 1, 0), Vector3(1.5, 1, 0), Vector3(1, 1.5, 0.25)};
        for (std::size_t i = 0; i < 3; ++i)
            t[i] = moving(corners[i] + Vector3(0, 0, from), corners[i] + Vector3(0, 0, to));
        return t;
    };
    EXPECT_EQ(first_contact(face, shifted(1, -3)), 0.25);
    EXPECT_EQ(first_contact(shifted(-1, 1), face), 0.375);  // the upper corner, 0.25 above, arrives first
    EXPECT_EQ(first_contact(face, shifted(1, 2)), std::nullopt);
    EXPECT_EQ(first_contact(face, shifted(-0.125, 5)), 0.0);
}

/// Small integers at both ends of the tick: degenerate sets, coplanar motion and simultaneous events abound.
class LatticeMotion {
public:
    explicit LatticeMotion(std::uint64_t seed) : random_(seed) {}
    MovingPoint point() { return {corner(), corner()}; }
    MovingTriangle triangle() { return {point(), point(), point()}; }
    /// Flattened: all motion in the plane z = 0.
    static void flatten(const std::vector<MovingPoint*>& points) {
        for (MovingPoint* p : points) p->start.z() = p->end.z() = 0.0;
    }

private:
    Vector3 corner() { return test::random_vector(coordinate_, random_); }
    std::uniform_int_distribution<int> coordinate_{-2, 2};
    std::mt19937_64 random_;
};

/// Positions at t = n/64 are exact for small integers, so the static exact test is a second opinion there: any contact
/// it sees must be reported, not later. A reported contact must be one of touching sets at its time.
void expect_consistent(const MovingTriangle& first, const MovingTriangle& second, std::optional<double> time) {
    const auto place = [](const MovingTriangle& t, double moment) {
        return Corners{at(t[0], moment), at(t[1], moment), at(t[2], moment)};
    };
    for (int n = 0; n <= 64; ++n) {
        const double moment = n / 64.0;
        if (triangles_intersect(place(first, moment), place(second, moment))) {
            ASSERT_TRUE(time) << "missed a contact at " << moment;
            ASSERT_LE(*time, moment);
            break;
        }
    }
    if (!time) return;
    ASSERT_GE(*time, 0.0);
    ASSERT_LE(*time, 1.0);
    ASSERT_LT(triangle_distance(place(first, *time), place(second, *time)).squared_distance, 1e-24);
}

TEST(FirstContact, OfAVertexAndAFaceAndOfTwoEdgesIsSeenWhereSamplesOfTheMotionSeeIt) {
    for (const bool edges : {false, true}) {
        LatticeMotion motion(edges ? 2 : 1);
        int hits = 0;
        for (int n = 0; n < 1500; ++n) {
            std::array<MovingPoint, 4> p;
            for (MovingPoint& point : p) point = motion.point();
            if (n % 3 == 0) LatticeMotion::flatten({&p[0], &p[1], &p[2], &p[3]});
            const std::optional<double> time = edges ? first_contact(MovingEdge{p[0], p[1]}, MovingEdge{p[2], p[3]})
                                                     : first_contact(p[0], MovingTriangle{p[1], p[2], p[3]});
            hits += time ? 1 : 0;
            if (edges) {
                expect_consistent({p[0], p[1], p[1]}, {p[2], p[3], p[3]}, time);
            } else {
                expect_consistent({p[0], p[0], p[0]}, {p[1], p[2], p[3]}, time);
            }
            if (HasFatalFailure()) return;
        }
        EXPECT_GT(hits, 100) << edges;
        EXPECT_LT(hits, 1400) << edges;
    }
}

TEST(MovingTriangles, VerdictIsTheSameBackwardsExchangedAndReordered) {
    LatticeMotion motion(3);
    const auto backwards = [](MovingTriangle t) {
        for (MovingPoint& p : t) std::swap(p.start, p.end);
        return t;
    };
    int hits = 0;
    for (int n = 0; n < 300; ++n) {
        const MovingTriangle first = motion.triangle();
        const MovingTriangle second = motion.triangle();
        const std::optional<double> time = first_contact(first, second);
        hits += time ? 1 : 0;
        ASSERT_EQ(first_contact(second, first), time);
        ASSERT_EQ(first_contact({first[2], first[0], first[1]}, {second[1], second[0], second[2]}), time);
        ASSERT_EQ(first_contact(backwards(first), backwards(second)).has_value(), time.has_value());
    }
    EXPECT_GT(hits, 30);
}

TEST(VertexFace, OneRoundingUnitDecides) {
    // The face at z = 0.1 moves up by 0.2, the vertex waits at the very height of its end or one unit above.
    const auto rising = [](double end) {
        return MovingTriangle{moving({0, 0, 0.1}, {0, 0, end}), moving({1, 0, 0.1}, {1, 0, end}),
                              moving({0, 1, 0.1}, {0, 1, end})};
    };
    const Vector3 vertex(0.25, 0.3, 0.3);
    EXPECT_EQ(first_contact(still(vertex), rising(0.3)), 1.0);
    EXPECT_EQ(first_contact(still(vertex), rising(std::nextafter(0.3, 0.0))), std::nullopt);
    const std::optional<double> above = first_contact(still(vertex), rising(std::nextafter(0.3, 1.0)));
    ASSERT_TRUE(above);
    EXPECT_LT(*above, 1.0);
    EXPECT_GT(*above, 0.999999);
}

TEST(VertexFace, AFaceSoSmallThatProductsOfItsSidesUnderflowIsMetAtTheKnownTime) {
    // Each component of the normal is the smallest number there is, of which a product can hold whole multiples only.
    // The vertex goes from 1/4 of it in front of the plane through corner 0 to 5/16 behind; term by term that rounds to
    // 1 - 0 - 0 and to -1 + 1 + 1, as if it stayed in front. It is in the corner after 1 / (1 + 5/4) of the tick.
    constexpr double tiny = 0x1p-537;
    const MovingTriangle speck{still({0, 0, 0}), still({tiny, -tiny, 0}), still({0, tiny, -tiny})};
    const MovingPoint vertex = moving({1.125, -0.4375, -0.4375}, {-1.40625, 0.546875, 0.546875});
    const double time = std::ldexp(static_cast<double>((std::int64_t{4} << 53) / 9), -53);
    EXPECT_EQ(first_contact(vertex, speck), time);
    EXPECT_EQ(oracle_first_contact(vertex, speck), time);
    // The same face, and the vertex beside it by its own size.
    const MovingTriangle beside{still({0, 0, 2 * tiny}), still({tiny, -tiny, 2 * tiny}), still({0, tiny, tiny})};
    EXPECT_EQ(first_contact(vertex, beside), std::nullopt);
}

/// Two triangles of size 1 with random corners that pass each other closely, turning; every seventh end is on a grid.
class FreeMotion {
public:
    explicit FreeMotion(std::uint64_t seed) : random_(seed) {}
    MovingTriangle triangle(double speed, bool on_grid) {
        std::uniform_real_distribution<double> place(-0.6, 0.6);
        const auto vector = [&]() -> Vector3 {
            Vector3 v = test::random_vector(place, random_);
            if (on_grid) v = (v * 4.0).array().round().matrix() / 4.0;
            return v;
        };
        const Vector3 by = speed * vector();
        MovingTriangle result;
        for (MovingPoint& p : result) {
            p.start = vector();
            p.end = p.start + by + 0.2 * vector();
        }
        return result;
    }

private:
    std::mt19937_64 random_;
};

TEST(FirstContact, FastAndIntegerPathAgreeToTheLastBit) {
    FreeMotion motion(4);
    std::array<int, 2> hits{};
    for (int n = 0; n < 2500; ++n) {
        const bool on_grid = n % 7 == 0;
        MovingTriangle first = motion.triangle(n % 2 == 0 ? 3.0 : 0.1, on_grid);
        MovingTriangle second = motion.triangle(0.3, on_grid);
        if (n % 5 == 0) {
            for (MovingPoint& p : first) p = {p.start * 1e-5, p.end * 1e-5};
            for (MovingPoint& p : second) p = {p.start * 1e-5, p.end * 1e-5};
        }
        if (n % 11 == 0) {
            const Vector3 far(1e4, -3e3, 2e4);
            for (MovingPoint& p : first) p = {p.start + far, p.end + far};
            for (MovingPoint& p : second) p = {p.start + far, p.end + far};
        }
        ASSERT_EQ(first_contact(first, second), oracle_first_contact(first, second)) << n;
        const MovingEdge edge{first[0], first[1]};
        const MovingEdge other{second[1], second[2]};
        const std::optional<double> crossing = first_contact(edge, other);
        ASSERT_EQ(crossing, oracle_first_contact(edge, other)) << n;
        const std::optional<double> piercing = first_contact(first[0], second);
        ASSERT_EQ(piercing, oracle_first_contact(first[0], second)) << n;
        hits[0] += crossing ? 1 : 0;
        hits[1] += piercing ? 1 : 0;
    }
    EXPECT_GT(hits[0], 30);
    EXPECT_GT(hits[1], 30);
}

TEST(FirstContact, FastAndIntegerPathAgreeOnDegenerateMotion) {
    LatticeMotion motion(5);
    for (int n = 0; n < 400; ++n) {
        MovingTriangle first = motion.triangle();
        MovingTriangle second = motion.triangle();
        if (n % 4 == 0) second[2] = second[1];  // a segment
        if (n % 6 == 0) LatticeMotion::flatten({&first[0], &first[1], &first[2], &second[0], &second[1], &second[2]});
        ASSERT_EQ(first_contact(first, second), oracle_first_contact(first, second)) << n;
        ASSERT_EQ(first_contact(first[0], second), oracle_first_contact(first[0], second)) << n;
        const MovingEdge edge{first[0], first[1]};
        const MovingEdge other{second[0], second[1]};
        ASSERT_EQ(first_contact(edge, other), oracle_first_contact(edge, other)) << n;
    }
}

/// A square of 2 × 2 cells with a wall on one side, split along its diagonals.
std::vector<Corners> walled_grid(double edge, const Vector3& corner) {
    std::vector<Corners> triangles;
    const auto node = [&](int i, int j, int k) -> Vector3 { return corner + edge * Vector3(i, j, k); };
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {
            triangles.push_back({node(i, j, 0), node(i + 1, j, 0), node(i, j + 1, 0)});
            triangles.push_back({node(i + 1, j, 0), node(i + 1, j + 1, 0), node(i, j + 1, 0)});
        }
        triangles.push_back({node(i, 0, 0), node(i + 1, 0, 0), node(i + 1, 0, 1)});
    }
    return triangles;
}

/// Time and kind by the oracle, feature by feature.
std::optional<FirstMeeting> oracle_meeting(const MovingTriangle& first, const MovingTriangle& second) {
    if (oracle_intersect({first[0].start, first[1].start, first[2].start},
                         {second[0].start, second[1].start, second[2].start})) {
        return FirstMeeting{0.0, Meeting::overlap_at_start};
    }
    std::optional<FirstMeeting> meeting;
    const auto take = [&meeting](std::optional<double> time, Meeting kind) {
        if (time && (!meeting || *time < meeting->time)) meeting = FirstMeeting{*time, kind};
    };
    for (std::size_t i = 0; i < 3; ++i) {
        take(oracle_first_contact(first[i], second), Meeting::vertex_face);
        take(oracle_first_contact(second[i], first), Meeting::vertex_face);
    }
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            take(oracle_first_contact(MovingEdge{first[i], first[(i + 1) % 3]},
                                      MovingEdge{second[j], second[(j + 1) % 3]}),
                 Meeting::edge_edge);
        }
    }
    return meeting;
}

TEST(FirstContact, SurfacesThatLandOnEachOtherAgreeWithTheIntegerPath) {
    struct Landing {
        double edge;
        Vector3 corner;
        Vector3 path;
        double angle = 0.0;
    };
    // Corners on corners, edges along edges, walls in one plane: at the middle of the tick, at its very end, a rounding
    // error beside each other, sliding; and everything turned or crossing freely.
    const std::vector<Landing> landings{
        {0.25, {0.25, 0.25, 0.25}, {0, 0, -0.5}},   {0.25, {0.25, 0.0, 0.25}, {0, 0, -0.25}},
        {0.25, {0.25, 0.125, 0.25}, {0, 0, -0.25}}, {0.1, {0.2, 0.3, 0.03}, {0, 0, -0.07}},
        {0.1, {0.2, 0.317, 0.03}, {0, 0, -0.07}},   {0.1, {0.7, 0.1, 0.0}, {-0.3, 0, 0}},
        {0.1, {0.7, 0.117, 0.0}, {-0.3, 0.1, 0}},   {0.125, {0.25, 0.25, 0.25}, {0.125, 0.25, -0.5}},
        {0.2, {0.13, 0.07, 0.3}, {0, 0, -0.7}, 0.4}};
    int hits = 0;
    int vertices = 0;
    for (std::size_t n = 0; n < landings.size(); ++n) {
        const Landing& landing = landings[n];
        const Matrix3 turn = Eigen::AngleAxisd(landing.angle, Vector3(0.3, 0.2, 1.0).normalized()).toRotationMatrix();
        const double edge = n == 7 ? 0.25 : landing.edge;
        for (const Corners& moved : walled_grid(landing.edge, landing.corner)) {
            for (const Corners& at_rest : walled_grid(edge, {0.1 * static_cast<double>(n % 2), 0, 0})) {
                // The same in units of which one is next to nothing: subnormal numbers, and nearly the largest.
                for (const double unit : {1.0, 1e-310, 1e-70, 1e120}) {
                    if (unit != 1.0 && n % 3 != 2) continue;
                    MovingTriangle first;
                    MovingTriangle second;
                    for (std::size_t i = 0; i < 3; ++i) {
                        first[i] = moving(unit * moved[i], unit * (turn * moved[i] + landing.path));
                        second[i] = still(unit * at_rest[i]);
                    }
                    const std::optional<FirstMeeting> expected = oracle_meeting(first, second);
                    const std::optional<FirstMeeting> met = first_meeting(first, second);
                    ASSERT_EQ(met.has_value(), expected.has_value()) << n << ' ' << unit;
                    if (!met) continue;
                    ASSERT_EQ(met->time, expected->time) << n << ' ' << unit;
                    ASSERT_EQ(met->kind, expected->kind) << n << ' ' << unit;
                    ++hits;
                    vertices += met->kind == Meeting::vertex_face ? 1 : 0;
                }
            }
        }
    }
    EXPECT_GT(hits, 200);
    EXPECT_GT(vertices, 50);
    EXPECT_LT(vertices, hits);
}

TEST(FirstContact, KindDistinguishesVertexFromEdge) {
    const auto dropped = [](const std::array<Vector3, 3>& corners) {
        MovingTriangle t;
        for (std::size_t i = 0; i < 3; ++i) t[i] = moving(corners[i], corners[i] - Vector3(0, 0, 2));
        return t;
    };
    const std::optional<FirstMeeting> tip = first_meeting(face, dropped({{{1, 1, 1}, {1, 1.5, 3}, {1.5, 1, 3}}}));
    ASSERT_TRUE(tip);
    EXPECT_EQ(tip->kind, Meeting::vertex_face);
    EXPECT_EQ(tip->time, 0.5);
    // A level edge across the edge y = 0 of the face, its ends outside: only edges can meet.
    const MovingTriangle sloped{still({0, 0, 0}), still({4, 0, 0}), still({2, 4, -4})};
    const std::optional<FirstMeeting> edge = first_meeting(sloped, dropped({{{2, -1, 1}, {2, 1, 1}, {2, 0, 3}}}));
    ASSERT_TRUE(edge);
    EXPECT_EQ(edge->kind, Meeting::edge_edge);
    EXPECT_EQ(edge->time, 0.5);
    const std::optional<FirstMeeting> inside = first_meeting(face, dropped({{{1, 1, 1}, {1, 1.5, -3}, {1.5, 1, 3}}}));
    ASSERT_TRUE(inside);
    EXPECT_EQ(inside->kind, Meeting::overlap_at_start);
    EXPECT_FALSE(first_meeting(face, dropped({{{1, 1, 3}, {1, 1.5, 4}, {1.5, 1, 4}}})));
}

struct Query {
    std::array<MovingPoint, 4> points;
    bool collides = false;
};

/// The data's rows: numerators have up to 67 bits, the quotient is a double.
std::vector<Query> read_queries(const std::filesystem::path& file) {
    std::vector<Query> queries;
    std::ifstream stream(file);
    std::string line;
    for (std::size_t row = 0; std::getline(stream, line); ++row) {
        if (row % 8 == 0) queries.emplace_back();
        std::ranges::replace(line, ',', ' ');
        std::istringstream words(line);
        Query& query = queries.back();
        MovingPoint& point = query.points[row % 4];
        for (int i = 0; i < 3; ++i) {
            std::string numerator;
            std::string denominator;
            words >> numerator >> denominator;
            const boost::multiprecision::cpp_rational value{boost::multiprecision::cpp_int(numerator),
                                                            boost::multiprecision::cpp_int(denominator)};
            (row % 8 < 4 ? point.start : point.end)[i] = static_cast<double>(value);
        }
        words >> query.collides;
    }
    return queries;
}

class QueryData : public testing::TestWithParam<const char*> {};

TEST_P(QueryData, EveryAnswerIsTheGivenOne) {
    TROCAR_DATA_OR_SKIP(file, "ccd_queries/" + std::string(GetParam()));
    const std::vector<Query> queries = read_queries(file);
    ASSERT_GE(queries.size(), 20U);
    const bool edges = std::string(GetParam()).find("edge-edge") != std::string::npos;
    for (std::size_t i = 0; i < queries.size(); ++i) {
        const auto& p = queries[i].points;
        const std::optional<double> time = edges ? first_contact(MovingEdge{p[0], p[1]}, MovingEdge{p[2], p[3]})
                                                 : first_contact(p[0], MovingTriangle{p[1], p[2], p[3]});
        EXPECT_EQ(time.has_value(), queries[i].collides) << "query " << i;
        EXPECT_EQ(time, edges ? oracle_first_contact(MovingEdge{p[0], p[1]}, MovingEdge{p[2], p[3]})
                              : oracle_first_contact(p[0], MovingTriangle{p[1], p[2], p[3]}))
            << "query " << i;
    }
}

INSTANTIATE_TEST_SUITE_P(Files, QueryData,
                         testing::Values("unit-tests/edge-edge/data_0_0.csv", "unit-tests/edge-edge/data_0_1.csv",
                                         "unit-tests/vertex-face/data_0_0.csv", "unit-tests/vertex-face/data_0_1.csv",
                                         "erleben-sliding-spike/edge-edge/data_0_0.csv",
                                         "erleben-sliding-spike/vertex-face/data_0_0.csv"),
                         [](const auto& file) { return test::test_name(file.param); });

}  // namespace
}  // namespace trocar
