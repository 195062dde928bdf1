#include "respond/intersection_regions.hpp"

#include <algorithm>

#include "geometry/exact.hpp"

namespace trocar {
namespace {

/// Side of a vertex relative to a face; a vertex in the plane counts as above, for every edge that ends in it.
int side_of_face(const Topology& topology, const Matrix3X& x, Index triangle, Index vertex) {
    const auto c = topology.triangles.col(triangle);
    return orientation_sign(x.col(c[0]), x.col(c[1]), x.col(c[2]), x.col(vertex)) <= 0 ? 1 : -1;
}

/// Side on which edge (p, q) passes edge (a, b). Vertices are sorted by number first, so that all triangles at either
/// edge agree on a tie.
int side_of_edge(const Matrix3X& x, Index p, Index q, Index a, Index b) {
    int flip = 1;
    if (p > q) {
        std::swap(p, q);
        flip = -flip;
    }
    if (a > b) {
        std::swap(a, b);
        flip = -flip;
    }
    if (p > a) {
        std::swap(p, a);
        std::swap(q, b);
    }
    return orientation_sign(x.col(p), x.col(q), x.col(a), x.col(b)) >= 0 ? flip : -flip;
}

}  // namespace

void IntersectionRegions::prepare(const Topology& topology) {
    used_ = 0;
    contours_.clear();
    seen_.assign(at(topology.vertex_count), 0);
    stamp_ = 0;
}

void IntersectionRegions::pierce(const Topology& topology, const Frame& frame, Index edges_of, Index face, Index pair) {
    const Matrix3X& x = frame.position;
    const auto c = topology.triangles.col(face);
    for (int e = 0; e < 3; ++e) {
        const Index p = topology.triangles(e, edges_of);
        const Index q = topology.triangles((e + 1) % 3, edges_of);
        if (side_of_face(topology, x, face, p) == side_of_face(topology, x, face, q)) continue;
        const int first = side_of_edge(x, p, q, c[0], c[1]);
        if (side_of_edge(x, p, q, c[1], c[2]) != first || side_of_edge(x, p, q, c[2], c[0]) != first) continue;
        const Vector3 normal = area_normal(corners_of(topology.triangles, x, face));
        const double height_p = normal.dot(x.col(p) - x.col(c[0]));
        const double height_q = normal.dot(x.col(q) - x.col(c[0]));
        const double share = height_p == height_q ? 0.5 : std::clamp(height_p / (height_p - height_q), 0.0, 1.0);
        const bool second = !piercings_.empty() && piercings_.back().pair == pair;
        segment_[at(pair)].at(second ? 1 : 0) = x.col(p) + share * (x.col(q) - x.col(p));
        piercings_.push_back({std::min(p, q), std::max(p, q), face, pair});
    }
}

Vector3 IntersectionRegions::centre_of(const IntersectionContour& contour) const {
    Vector3 sum = Vector3::Zero();
    double total = 0.0;
    for (const Index p : pairs_of(contour)) {
        const auto& [from, to] = segment_[at(p)];
        const double length = (to - from).norm();
        total += length;
        sum += 0.5 * length * (from + to);
    }
    return total > 0.0 ? Vector3(sum / total) : sum;
}

bool IntersectionRegions::is_cut(Index a, Index b) const {
    return std::binary_search(cut_.begin(), cut_.end(), std::array<Index, 2>{std::min(a, b), std::max(a, b)});
}

/// Two flood fills start from the ends of one cut edge, and the one with less area advances. The first to finish is the
/// smaller region. The cost is that of the smaller region, whatever the mesh.
bool IntersectionRegions::fill(const Topology& topology, const SurfaceNeighbours& surface, std::vector<Index>& inside) {
    inside.clear();
    if (cut_.empty()) return true;
    if (stamp_ > 0xfffffff0U) {
        std::fill(seen_.begin(), seen_.end(), 0U);
        stamp_ = 0;
    }
    stamp_ += 2;
    std::array<double, 2> area{};
    std::array<std::size_t, 2> next{};
    for (std::size_t side = 0; side < 2; ++side) {
        const Index seed = cut_.front().at(side);
        front_.at(side).assign(1, seed);
        seen_[at(seed)] = stamp_ + static_cast<std::uint32_t>(side);
        area.at(side) = surface.area(seed);
    }
    for (;;) {
        const std::size_t side = area[0] <= area[1] ? 0 : 1;
        std::vector<Index>& list = front_.at(side);
        if (next.at(side) == list.size()) {
            inside = list;
            return true;
        }
        const Index vertex = list[next.at(side)++];
        const std::uint32_t mine = stamp_ + static_cast<std::uint32_t>(side);
        for (const Index t : surface.triangles_at(vertex)) {
            for (int i = 0; i < 3; ++i) {
                const Index other = topology.triangles(i, t);
                if (other == vertex || seen_[at(other)] == mine || is_cut(vertex, other)) continue;
                if (seen_[at(other)] >= stamp_) return false;  // not separated
                seen_[at(other)] = mine;
                list.push_back(other);
                area.at(side) += surface.area(other);
            }
        }
    }
}

void IntersectionRegions::find(const Topology& topology, const SurfaceNeighbours& surface, const Frame& frame,
                               const std::vector<TrianglePair>& pairs) {
    const auto count = static_cast<Index>(pairs.size());
    piercings_.clear();
    connected_.reset(count);
    open_.assign(pairs.size(), 0);
    segment_.assign(pairs.size(), {Vector3::Zero(), Vector3::Zero()});
    contour_of_.assign(pairs.size(), -1);
    order_.clear();
    used_ = 0;
    for (Index p = 0; p < count; ++p) {
        const auto& [a, b] = pairs[at(p)];
        const Index body_a = topology.body_of_triangle[at(a)];
        const Index body_b = topology.body_of_triangle[at(b)];
        if (body_a == body_b || topology.bodies[at(body_b)].kind != BodyKind::tissue) continue;
        const std::size_t before = piercings_.size();
        pierce(topology, frame, a, b, p);
        pierce(topology, frame, b, a, p);
        const std::size_t ends = piercings_.size() - before;
        if (ends == 0) continue;          // the pair only touches
        if (ends != 2) open_[at(p)] = 1;  // an end lies exactly on an edge
        order_.push_back(p);
    }
    std::sort(piercings_.begin(), piercings_.end());
    for (std::size_t i = 0; i < piercings_.size();) {
        std::size_t end = i + 1;
        const auto same = [&](const Piercing& p) {
            return p.low == piercings_[i].low && p.high == piercings_[i].high && p.triangle == piercings_[i].triangle;
        };
        while (end < piercings_.size() && same(piercings_[end])) ++end;
        for (std::size_t k = i; k < end; ++k) {
            if (end - i != 2) open_[at(piercings_[k].pair)] = 1;  // a boundary edge, a false negative, or not manifold
            connected_.merge(piercings_[k].pair, piercings_[i].pair);
        }
        i = end;
    }
    for (const Index p : order_) {
        if (open_[at(p)] != 0) open_[at(connected_.find(p))] = 1;
    }
    std::sort(order_.begin(), order_.end(), [this](Index a, Index b) {
        const Index first = connected_.find(a);
        const Index second = connected_.find(b);
        return first != second ? first < second : a < b;
    });
    for (std::size_t i = 0; i < order_.size();) {
        const Index here = connected_.find(order_[i]);
        if (used_ == contours_.size()) contours_.emplace_back();
        IntersectionContour& contour = contours_[used_];
        contour.body_a = topology.body_of_triangle[at(pairs[at(order_[i])].a)];
        contour.body_b = topology.body_of_triangle[at(pairs[at(order_[i])].b)];
        contour.closed = open_[at(here)] == 0;
        contour.pairs.first = static_cast<Index>(i);
        while (i < order_.size() && connected_.find(order_[i]) == here) {
            contour_of_[at(order_[i])] = static_cast<Index>(used_);
            ++i;
        }
        contour.pairs.count = static_cast<Index>(i) - contour.pairs.first;
        contour.inside_a.clear();
        contour.inside_b.clear();
        contour.separates_a = contour.closed;
        contour.separates_b = contour.closed;
        contour.centre = centre_of(contour);
        ++used_;
    }
    for (std::size_t c = 0; c < used_; ++c) {
        IntersectionContour& contour = contours_[c];
        if (!contour.closed) continue;
        for (const bool first : {true, false}) {
            const Range& range = topology.bodies[at(first ? contour.body_a : contour.body_b)].vertices;
            cut_.clear();
            for (const Piercing& p : piercings_) {
                if (contour_of_[at(p.pair)] == static_cast<Index>(c) && range.contains(p.low)) {
                    cut_.push_back({p.low, p.high});
                }
            }
            // Each piercing is listed once per triangle at its edge. An edge crossed an even number of times is not
            // cut.
            std::sort(cut_.begin(), cut_.end());
            std::size_t kept = 0;
            for (std::size_t i = 0; i < cut_.size();) {
                std::size_t end = i + 1;
                while (end < cut_.size() && cut_[end] == cut_[i]) ++end;
                if (((end - i) / 2) % 2 == 1) cut_[kept++] = cut_[i];
                i = end;
            }
            cut_.resize(kept);
            bool& separates = first ? contour.separates_a : contour.separates_b;
            separates = fill(topology, surface, first ? contour.inside_a : contour.inside_b);
        }
    }
}

}  // namespace trocar
