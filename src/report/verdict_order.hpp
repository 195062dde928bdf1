// In which order the rows of a verdict stand, and which are dominated: apart from the table, since this order is what
// a reader takes for the judgement.
#pragma once

#include <string>
#include <vector>

#include "report/verdict.hpp"

namespace trocar {

/// How wrong a closed loop was on one scene (m), at least 1 µm: the depth left at worst. Where only instruments and
/// bones meet (I2I, I2R) that depth is the contact's own compliance; there it is how far at worst the bodies are from
/// the reference of equal stiffness, if there is one. NaN: no depth.
double error_on(const SceneResult& result, const std::string& pair_class);

bool have_depths(const std::vector<VerdictRow>& rows);

/// What a row is ranked by: VerdictRow::error as printed where the table has depths, else VerdictRow::wrong(); NaN = no
/// answer.
double error_of(const VerdictRow& row, bool depth);

/// Sorts rows that were planned on the same scenes and tells which move alike and which are dominated. Depths that
/// differ by less than a tenth are alike: of these, what misses or adds fewer pairs stands first, then the faster one.
void compare_rows(const Results& results, const std::vector<std::string>& scenes, std::vector<VerdictRow>& rows);

}  // namespace trocar
