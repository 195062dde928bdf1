#include <stdexcept>

#include "measure/metrics.hpp"

namespace trocar {
namespace {

constexpr const char* clock_source = "clock";
constexpr const char* counters = "counters";
constexpr const char* pair_truth = "pair truth";
constexpr const char* between = "space-time oracle";
constexpr const char* depth_before = "depth truth, frame that detect saw";
constexpr const char* passages = "geometry, path between the frames after the ticks";
constexpr const char* geometry = "geometry, frame after the tick";
constexpr const char* force = "force shown on the first driven instrument";
constexpr const char* audit = "trajectories, masses and forces shown";
constexpr const char* from_method = "reported by the response or the tissue";
constexpr const char* stored = "stored reference";
constexpr const char* paced = "paced loop";

void add_times(std::vector<SummaryFigure>& list) {
    list.push_back({"timed_ticks", "1", Better::neither, "Ticks that time figures are taken from: all but the first 10",
                    clock_source});
    list.push_back({"total_median_ns", "ns", Better::lower,
                    "Median time of a tick. Replay: update + detect; closed loop: move + update + detect + derive + "
                    "respond + advance. Truth is never timed",
                    clock_source});
    list.push_back({"total_p90_ns", "ns", Better::lower, "90 % of the ticks take at most this long", clock_source});
    list.push_back({"total_p99_ns", "ns", Better::lower,
                    "99 % of the ticks take at most this long; n/a below 1000 timed ticks", clock_source});
    list.push_back({"total_p999_ns", "ns", Better::lower,
                    "99.9 % of the ticks take at most this long; n/a below 100 000 timed ticks", clock_source});
    list.push_back(
        {"total_max_ns", "ns", Better::lower, "Longest tick, the machine's own interruptions included", clock_source});
    list.push_back({"total_cold_ns", "ns", Better::lower,
                    "Time of the first tick with a pair, warm-up or not: what a surgeon feels first", clock_source});
    list.push_back(
        {"deadline_misses", "1", Better::lower, "Timed ticks longer than 1 ms (back-to-back loop)", clock_source});
    list.push_back({"longest_burst", "1", Better::lower, "Most such ticks in a row", clock_source});
    for (const char* stage : stage_names) {
        const std::string name = stage;
        list.push_back({name + "_median_ns", "ns", Better::lower, "Median time of the stage " + name, clock_source});
        list.push_back({name + "_p99_ns", "ns", Better::lower,
                        "99 % of the ticks spend at most this long in the stage " + name + "; n/a below 1000 ticks",
                        clock_source});
    }
}

void add_pairs(std::vector<SummaryFigure>& list) {
    const std::vector<SummaryFigure> more{
        {"substeps", "1", Better::neither,
         "Steps that the stepper takes of the tissue in every tick; of operators where there is no tissue",
         "scene and stepper"},
        {"allocations_median", "1", Better::lower, "Median number of heap allocations inside the stages of a tick",
         counters},
        {"allocations_max", "1", Better::lower, "Most heap allocations inside the stages of a tick", counters},
        {"work_median", "1", Better::lower,
         "Median work of a tick: vertices read + cells visited + box tests + triangle tests", counters},
        {"work_max", "1", Better::lower, "Largest work of a tick", counters},
        {"pairs_mean", "1", Better::neither, "Reported pairs per tick, mean over all ticks", counters},
        {"pairs_median", "1", Better::neither, "Median number of pairs over the ticks that have one", counters},
        {"pairs_max", "1", Better::neither, "Most pairs in a tick", counters},
        {"native_contacts_mean", "1", Better::neither, "The library's own contacts per tick, mean", counters},
        {"judged_ticks", "1", Better::neither, "Ticks on which truth was computed", pair_truth},
        {"true_pairs", "1", Better::neither, "True pairs, summed over the judged ticks", pair_truth},
        {"true_touches", "1", Better::neither, "Of these, pairs that only touch in a vertex or an edge", pair_truth},
        {"false_negatives", "1", Better::lower,
         "True pairs not reported, summed over the judged ticks (one whose list a limit cut is always judged)",
         pair_truth},
        {"false_negatives_touch", "1", Better::lower, "Of these, pairs that only touch", pair_truth},
        {"false_positives", "1", Better::lower, "Reported pairs that are not true, summed over the judged ticks",
         pair_truth},
        {"precision", "1", Better::higher, "Share of the reported pairs that are true", pair_truth},
        {"recall", "1", Better::higher, "Share of the true pairs that are reported, touches included", pair_truth},
        {"recall_without_touches", "1", Better::higher, "The same over pairs that do more than touch", pair_truth},
        {"f1", "1", Better::higher, "Harmonic mean of precision and recall", pair_truth},
        {"query_distance_median_m", "m", Better::neither,
         "Median query distance: within which the contact generator wanted pairs of triangles brought; n/a where it "
         "asks for those that meet",
         counters},
        {"query_distance_max_m", "m", Better::neither, "Largest of the same", counters},
        {"true_proximity_pairs", "1", Better::neither,
         "Pairs of triangles that do not meet and are within the query distance, summed over the ticks judged in "
         "detail; n/a where no generator needs them",
         pair_truth},
        {"proximity_false_negatives", "1", Better::lower,
         "Of these: pairs within the query distance that were not reported", pair_truth},
        {"true_swept", "1", Better::neither, "Pairs that begin to touch between two frames, summed over the ticks",
         between},
        {"swept_false_negatives", "1", Better::lower,
         "Of these: reported neither as begun between frames nor as pair of the frame after", between},
        {"swept_false_positives", "1", Better::lower, "Contacts said to begin between frames that do not", between},
        {"swept_time_error_max", "1", Better::lower, "Worst error of a reported time of first contact, part of a tick",
         between},
        {"contact_events", "1", Better::neither, "Contacts of two bodies, from first touch until they are apart",
         between},
        {"contact_events_missed", "1", Better::lower, "Of these: never reported, neither at a frame nor between frames",
         between},
        {"onset_latency_median_s", "s", Better::lower,
         "Median time from first touch to the frame at which the detector first reports it, over the events reported",
         between},
        {"onset_latency_max_s", "s", Better::lower, "Largest of the same", between},
        {"depth_error_median_m", "m", Better::lower,
         "Median over ticks with a contact of the worst difference between a contact's depth and the true depth of the "
         "penetrating vertex",
         depth_before},
        {"depth_error_max_m", "m", Better::lower, "Largest of the same", depth_before},
        {"native_depth_error_median_m", "m", Better::lower,
         "The same for the library's own contacts, against the deepest corner of the two triangles", depth_before},
        {"native_depth_error_max_m", "m", Better::lower, "Largest of the same", depth_before}};
    list.insert(list.end(), more.begin(), more.end());
}

void add_audit(std::vector<SummaryFigure>& list) {
    const std::vector<SummaryFigure> more{
        {"energy_residual_j", "J", Better::lower,
         "Largest energy at any time that the audit of tissue and operators does not account for: gain less work of "
         "contacts, position corrections, held forces and operators, plus what dampers took; n/a where nothing yields",
         audit},
        {"energy_residual_share", "1", Better::lower, "The same as a share of all energy entered, the worse of the two",
         audit},
        {"momentum_residual_n_s", "N s", Better::lower,
         "Largest momentum at any time that this audit does not account for, reactions of pins included", audit},
        {"momentum_residual_share", "1", Better::lower,
         "The same as a share of the summed impulses of contacts, held forces and operators", audit},
        {"dissipated_energy_j", "J", Better::neither, "Energy that the tissue's dampers and drag took", audit},
        {"limiter_energy_j", "J", Better::neither, "Energy that went where the strain limiter acted", audit},
        {"absolute_work_j", "J", Better::neither,
         "Sum of the absolute work of scripts and operators against contact, tick by tick", audit}};
    list.insert(list.end(), more.begin(), more.end());
}

void add_outcome(std::vector<SummaryFigure>& list) {
    const std::vector<SummaryFigure> more{
        {"residual_penetration_median_m", "m", Better::lower,
         "True residual penetration after the tick: median over ticks with a pair or a depth", geometry},
        {"residual_penetration_max_m", "m", Better::lower, "Largest true residual penetration after a tick", geometry},
        {"residual_penetration_mean_m", "m", Better::lower,
         "Area mean of the depth over the penetrating samples: median over ticks with a depth", geometry},
        {"residual_penetration_final_m", "m", Better::lower, "True residual penetration after the last judged tick",
         geometry},
        {"residual_penetration_settled_m", "m", Better::lower,
         "Largest true depth from 200 ms after the last key of the motion on; n/a when the run ends before", geometry},
        {"overlap_volume_max_m3", "m³", Better::lower,
         "Largest volume that two closed bodies both fill after a tick; n/a with open sheets alone", geometry},
        {"min_translation_max_m", "m", Better::lower,
         "Longest path that a closed body would have to move to come free of another, along the best of 26 directions "
         "(axes, face and space diagonals of a cube)",
         geometry},
        {"ticks_to_clear_median", "1", Better::lower,
         "Ticks from a depth above 0.1 mm until it is cleared, median over the spells that were; resolution: the "
         "judged ticks",
         geometry},
        {"ticks_to_clear_max", "1", Better::lower, "Longest of the same", geometry},
        {"uncleared", "1", Better::lower, "1: the run ends with more than 0.1 mm left; 0: it does not", geometry},
        {"re_penetrations", "1", Better::lower, "Times that a depth above 0.1 mm came back after it had been cleared",
         geometry},
        {"overshoot_max_m", "m", Better::lower,
         "Largest gap within 20 ticks after a depth, less the distance that scripts moved bodies meanwhile", geometry},
        {"passed_through", "1", Better::lower,
         "Times that one of two bodies without tissue between them was driven through the other: a point of it went "
         "in and came out at the opposite side (closed), or it is wholly on the other side (open sheet); n/a without "
         "such bodies",
         passages},
        {"wrong_side_max", "1", Better::lower,
         "Most sample points and stretches of edges left on the wrong side after a tick", geometry},
        {"wrong_side_last", "1", Better::lower,
         "Sample points and stretches of edges on the wrong side after the last judged tick", geometry},
        {"wrong_side_vertices_max", "1", Better::lower, "Most vertices left on the wrong side after a tick", geometry},
        {"wrong_side_vertices_last", "1", Better::lower, "Vertices on the wrong side after the last judged tick",
         geometry},
        {"side_undecided_max", "1", Better::lower,
         "Most sample points after a tick whose side truth leaves open, since the rim of an open sheet is inside their "
         "body; they are in no depth and no wrong side",
         geometry},
        {"side_undecided_ticks", "1", Better::lower, "Judged ticks with such a sample", geometry},
        {"strain_over_max", "1", Better::lower, "Largest edge strain above the scene's strain limit", geometry},
        {"tool_moment_max_nm", "N m", Better::neither, "Largest moment about the tip on the tool", force},
        {"tip_force_max_n", "N", Better::neither, "Largest force at the tip by the device's rule, before any limiter",
         from_method},
        {"tip_force_jump_max_n", "N", Better::lower, "Largest change of the same from one tick to the next",
         from_method},
        {"device_force_max_n", "N", Better::neither, "Largest force shown after the device's limiters", from_method},
        {"device_force_jump_max_n", "N", Better::lower, "Largest change of the same from one tick to the next",
         from_method},
        {"roll_torque_max_nm", "N m", Better::lower,
         "Largest torque about the shaft, which a 3-DOF device cannot show; n/a without a trocar", from_method},
        {"saturated_ticks", "1", Better::lower, "Ticks in which the tip force was larger than the device's largest",
         from_method},
        {"grasped_max", "1", Better::neither, "Most tissue vertices held by a grasp in a tick", from_method},
        {"detached", "1", Better::neither, "Grasped vertices that slipped or tore loose", from_method},
        {"max_strain", "1", Better::lower, "Largest edge strain of the tissue (1 = doubled length)", from_method},
        {"ruptures", "1", Better::neither,
         "Places where tissue gave way: pressed for 5 ms with all that a contact's limit allows, or deeper than 0.1 mm "
         "at its strain limit",
         from_method},
        {"contacts_offered", "1", Better::neither, "Contacts of the generator, summed over the ticks", counters},
        {"contacts_used", "1", Better::neither, "Of these, contacts with a part in the response's effect", from_method},
        {"k_effective_n_per_m", "N/m", Better::neither,
         "Contact stiffness in force, of the stiffest pair with tissue; n/a: the response has no force law",
         from_method},
        {"mu_effective_ns_per_m", "N s/m", Better::neither, "Contact damping in force, of the same pair", from_method},
        {"relaxation_time_effective_s", "s", Better::neither, "mu / k in force, of the same pair", from_method},
        {"damping_ratio", "1", Better::neither,
         "mu / (2 sqrt(k m)) in force, with the mean mass m of a tissue vertex; 1: critical", from_method},
        {"skipped_apart", "1", Better::neither, "Of the others: not passed on, further apart than the look-ahead",
         from_method},
        {"skipped_no_direction", "1", Better::neither, "Of the others: touch, coplanar, degenerate", from_method},
        {"skipped_not_handled", "1", Better::neither, "Of the others: the method has no answer to them", from_method},
        {"skipped_reduced", "1", Better::neither, "Of the others: another contact stands for them", from_method},
        {"no_hit", "1", Better::lower, "Projections for which no contact point was found, summed over the ticks",
         from_method},
        {"limited_edges", "1", Better::lower, "Edges that the strain limiter acted on, summed over the ticks",
         from_method},
        {"force_rms_n", "N", Better::neither, "Root mean square of the tool force", force},
        {"force_max_n", "N", Better::neither, "Largest tool force (mean over a tick)", force},
        {"force_jump_p99_n", "N", Better::lower,
         "Change of the tool force from tick to tick before any filter, 99 %; n/a below 1000 ticks", force},
        {"force_jump_max_n", "N", Better::lower,
         "Largest change of the tool force from one tick to the next, the one from zero at the first tick included, "
         "before any filter",
         force},
        {"force_without_touch_m", "m", Better::lower,
         "Contact force at a distance: per body pair the largest clearance (the smaller of the tick's start and end) "
         "in a tick with more than 1 % of the pair's peak force. n/a where forces of pairs are not known, "
         "where no tick had force, and where not every tick was judged",
         geometry},
        {"force_flips", "1", Better::lower, "Ticks on which the tool force turned by more than 90 degrees", force},
        {"force_above_30hz_rms_n", "N", Better::lower,
         "Root mean square of the part of the tool force above 30 Hz, where no operator moves", force},
        {"force_above_30hz_share", "1", Better::lower, "Share of the tool force's energy above 30 Hz", force}};
    list.insert(list.end(), more.begin(), more.end());
    add_audit(list);
}

void add_reference(std::vector<SummaryFigure>& list) {
    // Filled by the comparison with the stored reference (reference/reference.hpp), once for each law of contact.
    for (const auto& [ending, law] : {std::pair{"_equal_k", "the reference with contact as stiff as the scene says"},
                                      std::pair{"_hard", "the reference with hard contact"}}) {
        const std::string end = ending;
        const std::string against = std::string("; against ") + law + ", n/a without one";
        list.push_back({"force_error_rms" + end, "N", Better::lower,
                        "Root mean square error of the tool force below 30 Hz" + against, stored});
        list.push_back({"force_error_worst" + end, "N", Better::lower,
                        "Largest error of the tool force below 30 Hz" + against, stored});
        list.push_back({"impulse_error_worst" + end, "N s", Better::lower,
                        "Largest error of the tool's impulse over 10 ms" + against, stored});
        list.push_back({"position_error_rms" + end, "m", Better::lower,
                        "Root mean square error of the place of the reference's points" + against, stored});
        list.push_back({"position_error_worst" + end, "m", Better::lower,
                        "Largest error of the place of the reference's points" + against, stored});
        list.push_back({"force_bound" + end, "N", Better::neither,
                        "How far the reference itself may be off, root mean square" + against, stored});
    }
    list.push_back({"reference_clears_hard", "1", Better::neither,
                    "1: the hard reference clears every depth within the strain limit; 0: it cannot; n/a without one",
                    stored});
}

void add_paced(std::vector<SummaryFigure>& list) {
    for (const auto& [start, what] :
         {std::pair{"paced", "From a tick's scheduled release, one every tick of the scene, to its end"},
          std::pair{"empty",
                    "The same of an empty loop beside it in a thread of its own: the machine beside that work"}}) {
        const std::string name = start;
        list.push_back({name + "_median_ns", "ns", Better::lower, std::string(what) + ": median", paced});
        list.push_back({name + "_p99_ns", "ns", Better::lower, "99 % of the same; n/a below 1000 ticks", paced});
        list.push_back({name + "_p999_ns", "ns", Better::lower, "99.9 % of the same; n/a below 100 000 ticks", paced});
        list.push_back({name + "_max_ns", "ns", Better::lower, "Longest of the same", paced});
        list.push_back({name + "_misses", "1", Better::lower, "Ticks that ended after the next one's release", paced});
        list.push_back({name + "_burst", "1", Better::lower, "Most such ticks in a row", paced});
    }
}

void add_metamorphic(std::vector<SummaryFigure>& list) {
    constexpr const char* asked = "the method asked twice";
    list.push_back({"metamorphic_pairs", "1", Better::neither,
                    "Pairs of all frames that a detector's metamorphic test asks about", asked});
    for (const auto& [name, what] :
         {std::pair{"twice", "the same question again in the same process"},
          std::pair{"triangles", "the triangles of every body (for detectors also its vertices) in another order"},
          std::pair{"bodies", "the bodies in the opposite order (for responses those of one kind)"},
          std::pair{"swapped", "two bodies that are tested against each other in the opposite order"},
          std::pair{"origin", "the origin 18 m away"},
          std::pair{"unit", "lengths in millimetres (responses: read from a file in millimetres)"}}) {
        const std::string key = std::string("metamorphic_") + name;
        list.push_back({key + "_pairs", "1", Better::lower,
                        std::string("Pairs that a detector reports in one of two answers only: ") + what, asked});
        list.push_back({key + "_m", "m", Better::lower,
                        std::string("Largest distance of a vertex between two runs of a closed loop: ") + what, asked});
        list.push_back({key + "_n", "N", Better::lower,
                        std::string("Largest difference of the load on a body between the two runs: ") + what, asked});
    }
}

std::vector<SummaryFigure> make_figures() {
    std::vector<SummaryFigure> list{
        {"ticks", "1", Better::neither, "Ticks done", counters},
        {"failed_ticks", "1", Better::lower, "Ticks whose outcome is not ok", counters},
        {"truncated_ticks", "1", Better::lower, "Ticks on which a limit cut the list of pairs", counters}};
    add_times(list);
    add_pairs(list);
    add_outcome(list);
    add_reference(list);
    add_paced(list);
    add_metamorphic(list);
    return list;
}

}  // namespace

std::string_view name_of(Better better) {
    switch (better) {
        case Better::lower:
            return "lower";
        case Better::higher:
            return "higher";
        case Better::neither:
            break;
    }
    return "neither";
}

const std::vector<SummaryFigure>& summary_figures() {
    static const std::vector<SummaryFigure> list = make_figures();
    return list;
}

const SummaryFigure& summary_figure(std::string_view name) {
    for (const SummaryFigure& figure : summary_figures()) {
        if (figure.name == name) return figure;
    }
    throw std::logic_error("no figure is named " + std::string(name));
}

std::string header_of(const SummaryFigure& figure) {
    return figure.unit == "1" ? figure.name : figure.name + " [" + figure.unit + "]";
}

}  // namespace trocar
