#pragma once

// Values as bytes, between two processes of one program.

#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "controller/common/errors.h"

namespace dexcheck {
namespace archive_detail {

template <typename T>
void Append(std::string* bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}
inline void Append(std::string* bytes, const std::string& text) {
  Append(bytes, text.size());
  *bytes += text;
}
template <typename T>
void Append(std::string* bytes, const std::vector<T>& list) {
  Append(bytes, list.size());
  for (const T& value : list) Append(bytes, value);
}

/// Takes so many bytes from the front.
inline std::string_view TakeFront(std::string_view* bytes, std::size_t count) {
  if (bytes->size() < count) throw Error("a message between two processes is cut short");
  const std::string_view front = bytes->substr(0, count);
  bytes->remove_prefix(count);
  return front;
}
template <typename T>
void Take(std::string_view* bytes, T* value) {
  static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
  std::memcpy(value, TakeFront(bytes, sizeof *value).data(), sizeof *value);
}
inline void Take(std::string_view* bytes, std::string* text) {
  std::size_t size = 0;
  Take(bytes, &size);
  *text = TakeFront(bytes, size);
}
template <typename T>
void Take(std::string_view* bytes, std::vector<T>* list) {
  std::size_t size = 0;
  Take(bytes, &size);
  list->clear();
  for (std::size_t i = 0; i < size; ++i) {
    list->emplace_back();
    Take(bytes, &list->back());
  }
}

}  // namespace archive_detail

/// Numbers, enumerations, texts and lists of these, one behind the other.
template <typename... Values>
std::string PackBytes(const Values&... values) {
  std::string bytes;
  (archive_detail::Append(&bytes, values), ...);
  return bytes;
}

/// Restores the values that PackBytes packed. @throws Error when the bytes are cut short.
template <typename... Values>
void UnpackBytes(std::string_view bytes, Values*... values) {
  (archive_detail::Take(&bytes, values), ...);
}

}  // namespace dexcheck
