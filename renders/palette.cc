#include "renders/palette.h"

#include <algorithm>
#include <limits>

namespace dexcheck {
namespace {

constexpr size_t kCells = size_t{1} << 15;
constexpr size_t kEven = 64;  // 4 x 4 x 4

/// A colour of the picture and how many pixels have it.
struct Entry {
  Palette::Color color;
  long count;
};

/// A range of entries that becomes one colour.
struct Box {
  size_t begin;
  size_t end;
  long count;
};

Palette::Color CenterOf(size_t cell) {
  const auto center = [](size_t five_bits) { return static_cast<std::uint8_t>(five_bits << 3 | 4U); };
  return {center(cell >> 10), center(cell >> 5 & 31U), center(cell & 31U)};
}

std::vector<Entry> ListColors(const Image& picture) {
  std::vector<long> counts(kCells);
  for (size_t i = 0; i + 2 < picture.rgb.size(); i += 3) {
    const std::uint8_t* const rgb = &picture.rgb[i];
    ++counts[static_cast<size_t>(rgb[0] >> 3 << 10 | rgb[1] >> 3 << 5 | rgb[2] >> 3)];
  }
  std::vector<Entry> entries;
  for (size_t cell = 0; cell < kCells; ++cell) {
    if (counts[cell] > 0) entries.push_back({CenterOf(cell), counts[cell]});
  }
  return entries;
}

/// The channel in which a box is widest.
size_t FindWidest(const std::vector<Entry>& entries, const Box& box) {
  size_t widest = 0;
  int width = -1;
  for (size_t channel = 0; channel < 3; ++channel) {
    int least = 255;
    int most = 0;
    for (size_t i = box.begin; i < box.end; ++i) {
      least = std::min<int>(least, entries[i].color[channel]);
      most = std::max<int>(most, entries[i].color[channel]);
    }
    if (most - least > width) {
      width = most - least;
      widest = channel;
    }
  }
  return widest;
}

/// Cuts a box of at least two entries in two with as nearly half of the pixels each as may be; the first
/// stays.
Box Cut(std::vector<Entry>* entries, Box* box) {
  const size_t channel = FindWidest(*entries, *box);
  const auto first = entries->begin();
  std::stable_sort(first + static_cast<long>(box->begin), first + static_cast<long>(box->end),
                   [&](const Entry& a, const Entry& b) { return a.color[channel] < b.color[channel]; });
  size_t middle = box->begin + 1;
  long count = (*entries)[box->begin].count;
  while (middle + 1 < box->end && 2 * count < box->count) count += (*entries)[middle++].count;
  const Box rest = {middle, box->end, box->count - count};
  *box = {box->begin, middle, count};
  return rest;
}

Palette::Color MeanOf(const std::vector<Entry>& entries, const Box& box) {
  std::array<long, 3> sum = {};
  for (size_t i = box.begin; i < box.end; ++i) {
    for (size_t channel = 0; channel < 3; ++channel) {
      sum[channel] += entries[i].count * entries[i].color[channel];
    }
  }
  Palette::Color mean = {};
  for (size_t channel = 0; channel < 3; ++channel) {
    mean[channel] = static_cast<std::uint8_t>(sum[channel] / box.count);
  }
  return mean;
}

}  // namespace

Palette::Palette(const Image& picture) : nearest_(kCells) {
  for (size_t i = 0; i < kEven; ++i) {
    const auto level = [](size_t two_bits) { return static_cast<std::uint8_t>(85 * two_bits); };
    colors_[i] = {level(i >> 4), level(i >> 2 & 3U), level(i & 3U)};
  }
  std::vector<Entry> entries = ListColors(picture);
  std::vector<Box> boxes;
  if (!entries.empty()) boxes.push_back({0, entries.size(), static_cast<long>(picture.rgb.size() / 3)});
  while (!boxes.empty() && boxes.size() < kColors - kEven) {
    const auto can_be_cut = [](const Box& box) { return box.end - box.begin >= 2; };
    const auto fullest = std::max_element(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
      return (can_be_cut(a) ? a.count : 0) < (can_be_cut(b) ? b.count : 0);
    });
    if (!can_be_cut(*fullest)) break;
    const Box rest = Cut(&entries, &*fullest);
    boxes.push_back(rest);
  }
  for (size_t i = 0; i < boxes.size(); ++i) colors_[kEven + i] = MeanOf(entries, boxes[i]);
  for (size_t cell = 0; cell < kCells; ++cell) {
    const Color color = CenterOf(cell);
    int least = std::numeric_limits<int>::max();
    for (size_t i = 0; i < kEven + boxes.size(); ++i) {
      int distance = 0;
      for (size_t channel = 0; channel < 3; ++channel) {
        const int difference = color[channel] - colors_[i][channel];
        distance += difference * difference;
      }
      if (distance >= least) continue;
      least = distance;
      nearest_[cell] = static_cast<std::uint8_t>(i);
    }
  }
}

}  // namespace dexcheck
