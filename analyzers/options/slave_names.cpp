#include "analyzers/options/slave_names.h"

#include <vector>

namespace ecaudit {

std::string SlaveNames::Number(unsigned position) const {
  return std::to_string(from_one ? position + 1 : position);
}

std::string SlaveNames::Of(unsigned position, std::string_view about) const {
  std::string inside = from_one ? "position " + std::to_string(position) : std::string();
  if (!about.empty()) inside.append(inside.empty() ? "" : ", ").append(about);
  std::string text = "slave " + Number(position);
  if (!inside.empty()) text += " (" + inside + ")";
  return text;
}

std::string SlaveNames::Of(const std::set<unsigned>& positions) const {
  if (positions.size() == 1) return Of(*positions.begin());
  return "slaves " + Ranges(positions);
}

std::string SlaveNames::Ranges(const std::set<unsigned>& positions) const {
  std::string text = ecaudit::Ranges(positions);
  if (!from_one) return text;
  std::set<unsigned> numbers;
  for (const unsigned position : positions) numbers.insert(position + 1);
  return ecaudit::Ranges(numbers) + (positions.size() == 1 ? " (position " : " (positions ") + text + ")";
}

std::string SlaveNames::List(const std::set<unsigned>& positions, std::size_t most) const {
  if (positions.size() == 1) return Of(*positions.begin());
  std::string numbers;
  std::string places;
  std::size_t named = 0;
  for (const unsigned position : positions) {
    if (named == most) break;
    const std::string_view between = named++ == 0 ? "" : ", ";
    numbers.append(between).append(Number(position));
    places.append(between).append(std::to_string(position));
  }
  std::string text = "slaves " + numbers;
  if (from_one) text += (named == 1 ? " (position " : " (positions ") + places + ")";
  if (named < positions.size()) text += " and " + std::to_string(positions.size() - named) + " more";
  return text;
}

std::string SlaveNames::Span(unsigned first, unsigned last) const {
  std::string text = "slaves " + Number(first) + "-" + Number(last);
  if (from_one) text += " (positions " + std::to_string(first) + "-" + std::to_string(last) + ")";
  return text;
}

std::optional<SlavePos> SlaveNames::Position(SlavePos number) const {
  if (!from_one) return number;
  if (number == 0) return std::nullopt;
  return static_cast<SlavePos>(number - 1);
}

std::string Ranges(const std::set<unsigned>& sorted) {
  const std::vector<unsigned> positions(sorted.begin(), sorted.end());
  std::string text;
  for (std::size_t i = 0; i < positions.size();) {
    std::size_t end = i;
    while (end + 1 < positions.size() && positions[end + 1] == positions[end] + 1) ++end;
    if (!text.empty()) text += ", ";
    text += std::to_string(positions[i]);
    if (end > i) text += "-" + std::to_string(positions[end]);
    i = end + 1;
  }
  return text;
}

}  // namespace ecaudit
