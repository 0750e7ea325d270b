#pragma once

#include <cstddef>
#include <cstdint>

namespace dexcheck {

/// Fingertips of a grasp, bit i for the i-th.
using ContactSet = std::uint32_t;

/// All of `count` fingertips.
constexpr ContactSet AllContacts(int count) { return (ContactSet{1} << count) - 1; }
constexpr bool Contains(ContactSet set, size_t fingertip) { return (set >> fingertip & 1U) != 0; }

}  // namespace dexcheck
