// Compares contacts with stored ones one by one, and pairs with the exact oracle. The oracle serves when the frames
// have changed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "contact/contact.hpp"
#include "measure/pair_truth.hpp"
#include "scene/world.hpp"
#include "study/contact_baseline.hpp"

namespace trocar {

struct BaselineTolerance {
    double length = 1.0e-9;  ///< m, of depths and points
    double angle = 1.0e-6;   ///< rad, of normals
};

/// One contact or pair that differs from the stored one or from the oracle.
struct ContactDifference {
    enum class What {
        lost,     ///< stored, not found now
        added,    ///< found now, not stored
        changed,  ///< other kind or geometry than the stored one
        missed,   ///< false negative against the oracle
        untrue    ///< false positive against the oracle
    };
    What what = What::lost;
    std::int64_t tick = 0;
    Index a = -1;  ///< a < b, triangle numbers of the topology
    Index b = -1;
    std::optional<Contact> before;  ///< stored contact; for `missed`, derived from the coordinates (contact/derive.hpp)
    std::optional<Contact> after;
    /// Differences of a `changed` contact, m and rad; infinite where only one of the two is a number.
    double depth = 0.0;
    double point = 0.0;
    double angle = 0.0;
    double distance = 0.0;  ///< m, for `untrue`: between the two triangles
    bool touch = false;     ///< for `missed`: the triangles touch without crossing
};
const char* name_of(ContactDifference::What what);

/// Keeps the ten worst differences, worst first: lost, added, changed, then false negatives and positives. Lost, added
/// and missed contacts are ordered by depth, changed ones by the largest difference relative to its tolerance. False
/// positives are ordered by distance. Touching pairs come last, ties are ordered by tick and triangles.
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
    std::int64_t compared = 0;  ///< contacts that both have
    std::int64_t missing = 0;   ///< contacts of the baseline that are gone
    std::int64_t extra = 0;     ///< contacts that the baseline does not have
    std::int64_t other_kind = 0;
    double worst_depth = 0.0;  ///< m, maximum over contacts; infinite where only one of the two is a number
    double worst_point = 0.0;  ///< m
    double worst_angle = 0.0;  ///< rad
    std::string outcome;       ///< "ok -> crashed"; empty: unchanged
    std::vector<ContactDifference> worst;
    [[nodiscard]] bool within(const BaselineTolerance& tolerance) const;
};

/// Several contacts of one pair in one tick are matched to their nearest counterparts.
AnswerDifference compare_answers(const BaselineAnswer& before, const BaselineAnswer& after,
                                 const BaselineTolerance& tolerance);

/// Keeps only the ticks that are multiples of `every`.
void keep_every(std::int64_t every, BaselineAnswer& answer);

/// Accumulates the agreement of a detector's pairs with the oracle over ticks.
class TruthComparison {
public:
    /// Precondition: the frame is finite. `contacts` in any order.
    void add(const Topology& topology, const Frame& frame, const TickTruth& truth,
             const std::vector<Contact>& contacts);
    [[nodiscard]] const TruthFigures& figures() const { return figures_; }
    [[nodiscard]] const std::vector<ContactDifference>& worst() const { return worst_.list(); }

private:
    TruthFigures figures_;
    WorstDifferences worst_;
};

/// True when no error rate rises: fraction of false negatives, of false positives, and of ticks not examined. Touching
/// false negatives do not count when earlier ones existed. Without earlier figures any error counts as worse.
bool is_no_worse(const std::optional<TruthFigures>& before, std::int64_t ticks_before, const TruthFigures& after,
                 std::int64_t ticks_after);

}  // namespace trocar
