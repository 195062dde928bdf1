#include "geometry/orientation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "geometry/exact.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/triangle_sides.hpp"

namespace trocar {
namespace {

using Edge = std::span<const TriangleSide>;

bool is_collapsed(const Triangles& triangles, Index t) {
    const auto c = triangles.col(t);
    return c[0] == c[1] || c[1] == c[2] || c[2] == c[0];
}

/// A neighbour across an edge, and whether both traverse it in the same direction, which is an error.
struct Neighbour {
    Index triangle;
    bool disagrees;
};

/// Shells of the mesh. For each triangle: whether it is turned relative to the first one of its shell.
class Shells {
public:
    explicit Shells(Index triangles)
        : neighbours_(at(triangles)), shell_(at(triangles), -1), turned_(at(triangles), 0) {}

    void connect(const TriangleSide& a, const TriangleSide& b) {
        const bool disagrees = a.forward == b.forward;
        neighbours_[at(a.triangle)].push_back({b.triangle, disagrees});
        neighbours_[at(b.triangle)].push_back({a.triangle, disagrees});
    }

    /// Calls use(triangles of one shell, consistent) for each.
    template <typename Use>
    void for_each(const Use& use) {
        std::vector<Index> members;
        for (Index seed = 0; seed < static_cast<Index>(shell_.size()); ++seed) {
            if (shell_[at(seed)] >= 0 || neighbours_[at(seed)].empty()) continue;
            members.assign(1, seed);
            shell_[at(seed)] = seed;
            bool consistent = true;
            for (std::size_t next = 0; next < members.size(); ++next) {
                const Index t = members[next];
                for (const Neighbour& n : neighbours_[at(t)]) {
                    const bool turns = turned(t) != n.disagrees;
                    if (shell_[at(n.triangle)] < 0) {
                        shell_[at(n.triangle)] = seed;
                        turned_[at(n.triangle)] = turns ? 1 : 0;
                        members.push_back(n.triangle);
                    } else if (turned(n.triangle) != turns) {
                        consistent = false;
                    }
                }
            }
            use(members, consistent);
        }
    }
    [[nodiscard]] bool turned(Index triangle) const { return turned_[at(triangle)] != 0; }

private:
    std::vector<std::vector<Neighbour>> neighbours_;
    std::vector<Index> shell_;
    std::vector<std::uint8_t> turned_;
};

}  // namespace

OrientationReport orientation_of(const Matrix3X& given_vertices, const Triangles& given_triangles) {
    Matrix3X vertices = given_vertices;
    Triangles triangles = given_triangles;
    weld(vertices, triangles);
    std::vector<TriangleSide> sides = sorted_sides(triangles);
    std::erase_if(sides, [&triangles](const TriangleSide& side) { return is_collapsed(triangles, side.triangle); });
    OrientationReport report;
    Shells shells(static_cast<Index>(triangles.cols()));
    report.closed = !sides.empty();
    for_each_edge(sides, [&report](Edge edge) { report.closed = report.closed && edge.size() > 1; });
    std::vector<std::uint8_t> unsure(at(static_cast<Index>(triangles.cols())), 0);  // at a hole or a disagreeing edge
    for_each_edge(sides, [&](Edge edge) {
        const auto begin = edge.begin();
        const auto end = edge.end();
        const auto count = end - begin;
        const auto forward = std::count_if(begin, end, [](const TriangleSide& side) { return side.forward; });
        const auto difference = std::abs(2 * forward - count);
        if (count == 1) {
            unsure[at(begin->triangle)] = 1;
        } else if (count == 2) {
            shells.connect(*begin, *(begin + 1));
        } else {
            // At an edge with more than two triangles, those of opposite directions belong together.
            const auto opposite =
                std::find_if(begin + 1, end, [&](const TriangleSide& side) { return side.forward != begin->forward; });
            for (auto side = begin + 1; side != end; ++side) {
                if (side->forward != begin->forward) shells.connect(*begin, *side);
                if (side->forward == begin->forward && opposite != end) shells.connect(*opposite, *side);
            }
        }
        if (difference <= (report.closed ? 0 : count % 2)) return;
        ++report.disagreeing_edges;
        for (auto side = begin; side != end; ++side) unsure[at(side->triangle)] = 1;
        if (report.first_disagreeing[0] >= 0) return;
        const bool path = 2 * forward > count;
        const auto first = std::find_if(begin, end, [path](const TriangleSide& side) { return side.forward == path; });
        const auto second =
            std::find_if(first + 1, end, [path](const TriangleSide& side) { return side.forward == path; });
        report.first_disagreeing = {first->triangle, second == end ? first->triangle : second->triangle};
    });
    bool all_consistent = true;
    shells.for_each([&](const std::vector<Index>& members, bool consistent) {
        all_consistent = all_consistent && consistent;
        const auto turned = std::count_if(members.begin(), members.end(), [&](Index t) { return shells.turned(t); });
        const bool fewer = 2 * turned <= static_cast<std::ptrdiff_t>(members.size());
        if (turned > 0) {
            for (const Index t : members) {
                if (shells.turned(t) == fewer) report.to_turn.push_back(t);
            }
            return;
        }
        const bool sure = std::none_of(members.begin(), members.end(), [&](Index t) { return unsure[at(t)] != 0; });
        if (!sure) return;
        const Vector3 origin = vertices.col(triangles(0, members.front()));
        double six_volumes = 0.0;
        double twice_area = 0.0;
        for (const Index t : members) {
            const Vector3 a = vertices.col(triangles(0, t)) - origin;
            const Vector3 b = vertices.col(triangles(1, t)) - origin;
            const Vector3 c = vertices.col(triangles(2, t)) - origin;
            six_volumes += a.dot(b.cross(c));
            twice_area += (b - a).cross(c - a).norm();
        }
        // Two coincident sheets enclose a volume by rounding only.
        constexpr double no_volume = 1e-12;
        const double rounding = no_volume * std::pow(0.5 * twice_area, 1.5);
        const double volume = six_volumes / 6.0;
        if (volume > rounding) return;
        ShellInsideOut shell{members, volume < -rounding ? volume : 0.0};
        std::sort(shell.triangles.begin(), shell.triangles.end());
        report.inside_out.push_back(std::move(shell));
    });
    if (!all_consistent) report.to_turn.clear();
    std::sort(report.to_turn.begin(), report.to_turn.end());
    return report;
}

double winding_number(const Matrix3X& vertices, const Triangles& triangles, const Vector3& point,
                      const std::vector<Index>& without) {
    double angle = 0.0;
    for (Index t = 0; t < triangles.cols(); ++t) {
        if (std::binary_search(without.begin(), without.end(), t)) continue;
        const Vector3 a = vertices.col(triangles(0, t)) - point;
        const Vector3 b = vertices.col(triangles(1, t)) - point;
        const Vector3 c = vertices.col(triangles(2, t)) - point;
        const double la = a.norm();
        const double lb = b.norm();
        const double lc = c.norm();
        angle += 2.0 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return angle / (4.0 * std::numbers::pi);
}

bool is_cavity(const Matrix3X& vertices, const Triangles& triangles, const ShellInsideOut& shell) {
    const Corners corners = corners_of(triangles, vertices, shell.triangles.front());
    const Vector3 middle = (corners[0] + corners[1] + corners[2]) / 3.0;
    // A shell that touches the surrounding surface (winding number one half there) is a cavity too.
    constexpr double surrounded = 0.25;
    return shell.volume < 0.0 && winding_number(vertices, triangles, middle, shell.triangles) > surrounded;
}

Triangles mended(const Matrix3X& vertices, const Triangles& triangles) {
    Triangles result(3, triangles.cols());
    const auto repeated = repeated_triangles(vertices, triangles, true);
    Index kept = 0;
    for (Index t = 0; t < triangles.cols(); ++t) {
        const auto found = std::lower_bound(repeated.begin(), repeated.end(), std::array<Index, 2>{t, -1});
        if (found == repeated.end() || (*found)[0] != t) result.col(kept++) = triangles.col(t);
    }
    result.conservativeResize(Eigen::NoChange, kept);
    const auto turn = [&result](const std::vector<Index>& list) {
        for (const Index t : list) std::swap(result(1, t), result(2, t));
    };
    turn(orientation_of(vertices, result).to_turn);
    // Large ones first: whether a small one is a cavity depends on what surrounds it.
    std::vector<ShellInsideOut> inside_out = orientation_of(vertices, result).inside_out;
    std::sort(inside_out.begin(), inside_out.end(),
              [](const ShellInsideOut& a, const ShellInsideOut& b) { return a.volume < b.volume; });
    for (const ShellInsideOut& shell : inside_out) {
        if (shell.volume < 0.0 && !is_cavity(vertices, result, shell)) turn(shell.triangles);
    }
    return result;
}

std::vector<std::array<Index, 2>> repeated_triangles(const Matrix3X& given_vertices, const Triangles& given_triangles,
                                                     bool same_place) {
    Triangles triangles = given_triangles;
    if (same_place) {
        Matrix3X vertices = given_vertices;
        weld(vertices, triangles);
    }
    std::vector<std::array<Index, 4>> turned;  // lowest corner first, then the triangle's number
    turned.reserve(at(static_cast<Index>(triangles.cols())));
    for (Index t = 0; t < triangles.cols(); ++t) {
        if (is_collapsed(triangles, t)) continue;
        const auto c = triangles.col(t);
        const int low = static_cast<int>(std::min_element(c.data(), c.data() + 3) - c.data());
        turned.push_back({c[low], c[(low + 1) % 3], c[(low + 2) % 3], t});
    }
    std::sort(turned.begin(), turned.end());
    std::vector<std::array<Index, 2>> repeated;
    for (std::size_t i = 1, first = 0; i < turned.size(); ++i) {
        if (!std::equal(turned[i].begin(), turned[i].begin() + 3, turned[first].begin())) {
            first = i;
        } else {
            repeated.push_back({turned[i][3], turned[first][3]});
        }
    }
    std::sort(repeated.begin(), repeated.end());
    return repeated;
}

std::string first_of(const std::vector<Index>& numbers) {
    constexpr std::size_t most = 5;
    std::string text;
    for (std::size_t i = 0; i < std::min(numbers.size(), most); ++i)
        text += fmt::format("{}{}", i > 0 ? ", " : "", numbers[i]);
    if (numbers.size() > most) text += fmt::format(" and {} more", numbers.size() - most);
    return text;
}

}  // namespace trocar
