// Contacts held against those that were kept, one by one, since a mean would hide the one that went wrong; and pairs
// held against exact truth, which is all that can be said once the frames are others.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "contact/contact.hpp"
#include "scene/world.hpp"
#include "study/contact_baseline.hpp"

namespace trocar {

struct BaselineTolerance {
    double length = 1.0e-9;  ///< m, for depths and points
    double angle = 1.0e-6;   ///< rad, for normals
};

/// One contact or pair that is not as it was, or not as it truly is.
struct ContactDifference {
    enum class What {
        lost,     ///< kept, and gone
        added,    ///< not kept
        changed,  ///< another kind or geometry than the one kept
        missed,   ///< of truth: a pair that meets and was not reported
        untrue    ///< of truth: a pair that was reported and does not meet
    };
    What what = What::lost;
    std::int64_t tick = 0;
    Index a = -1;  ///< a < b, triangle numbers of the topology
    Index b = -1;
    std::optional<Contact> before;  ///< as kept; of `missed` what the coordinates report (contact/derive.hpp)
    std::optional<Contact> after;
    /// m and rad, of `changed`: how far the two are apart, infinite where only one of them is a number.
    double depth = 0.0;
    double point = 0.0;
    double angle = 0.0;
    double distance = 0.0;  ///< m, of `untrue`: between the two triangles
    bool touch = false;     ///< of `missed`: the two only touch
};
/// "lost", "added", …
const char* name_of(ContactDifference::What what);

/// The ten worst of those that were shown to it, worst first. Lost before new before changed ones; among the lost, new
/// and missed the deepest first, among the changed by the worst figure in units of its tolerance, among the untrue the
/// farthest apart; missed and untrue by length together, those that only touch last. Ties by tick and triangles.
class WorstDifferences {
public:
    static constexpr std::size_t most = 10;
    explicit WorstDifferences(const BaselineTolerance& tolerance = {}) : tolerance_(tolerance) {}
    void add(ContactDifference difference);
    [[nodiscard]] const std::vector<ContactDifference>& list() const { return list_; }

private:
    [[nodiscard]] bool is_worse(const ContactDifference& one, const ContactDifference& other) const;
    BaselineTolerance tolerance_;
    std::vector<ContactDifference> list_;
};

struct AnswerDifference {
    std::int64_t compared = 0;         ///< contacts that both have
    std::int64_t missing = 0;  ///< contacts of the baseline that are gone
    std::int64_t extra = 0;  ///< contacts that the baseline does not have
    std::int64_t other_kind = 0;
    double worst_depth = 0.0;  ///< m, largest of any contact; infinite where only one of the two is a number
    double worst_point = 0.0;  ///< m
    double worst_angle = 0.0;  ///< rad
    std::string outcome;       ///< "ok -> crashed"; empty: the same
    std::vector<ContactDifference> worst;
    [[nodiscard]] bool within(const BaselineTolerance& tolerance) const;
};

/// Several contacts of one pair in one tick are held against each other so that those come together that are nearest.
AnswerDifference compare_answers(const BaselineAnswer& before, const BaselineAnswer& after,
                                 const BaselineTolerance& tolerance);

/// Leaves the ticks that are multiples of `every`.
void keep_every(std::int64_t every, BaselineAnswer& answer);

/// What the frame itself reports one tick.
struct TickTruth {
    std::vector<TrianglePair> pairs;  ///< that meet, sorted
    std::vector<Index> touch;         ///< positions in pairs of those that only touch
};
TickTruth truth_of(const Topology& topology, const Frame& frame);

/// Gathers how an answer's pairs agree with truth, tick by tick.
class TruthComparison {
public:
    /// The frame is finite; `contacts` in any order.
    void add(const Topology& topology, const Frame& frame, const TickTruth& truth,
             const std::vector<Contact>& contacts);
    [[nodiscard]] const TruthFigures& figures() const { return figures_; }
    [[nodiscard]] const std::vector<ContactDifference>& worst() const { return worst_.list(); }

private:
    TruthFigures figures_;
    WorstDifferences worst_;
};

/// Whether pairs agree with truth at least as well as those of other frames did: no larger part of the true pairs is
/// missing, no larger part of the reported ones untrue, and no smaller part of the stream's `ticks` was examined.
/// Missing pairs that only touch do not count where such were missing before: nobody promised them then. Without
/// figures of before nothing may be wrong.
bool is_no_worse(const std::optional<TruthFigures>& before, std::int64_t ticks_before, const TruthFigures& after,
                 std::int64_t ticks_after);

}  // namespace trocar
