#pragma once

// XML documents of robots: parsing in one line of error, children, attributes.

#include <tinyxml2.h>

#include <algorithm>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/common/errors.h"

namespace dexcheck {

/// Whether a word is one of the words that blanks separate; an empty word where there are none.
inline bool IsAmong(std::string_view words, std::string_view word) {
  return (" " + std::string(words) + " ").find(" " + std::string(word) + " ") != std::string::npos;
}

/// @param shown the file in messages. @throws InputError "FILE:LINE: is not XML, XML_ERROR_...".
inline void ParseXml(std::string_view text, const std::string& shown, tinyxml2::XMLDocument* document) {
  if (document->Parse(text.data(), text.size()) == tinyxml2::XML_SUCCESS) return;
  throw InputError(shown + ":" + std::to_string(std::max(document->ErrorLineNum(), 1)) + ": is not XML, " +
                   document->ErrorName());
}

/// Returns the child elements, of one name or all, as they are now: a loop over them may delete each.
/// @param parent null has no children.
template <typename Element>
std::vector<Element*> ListChildren(Element* parent, const char* name = nullptr) {
  std::vector<Element*> children;
  if (parent == nullptr) return children;
  for (Element* child = parent->FirstChildElement(name); child != nullptr;
       child = child->NextSiblingElement(name)) {
    children.push_back(child);
  }
  return children;
}

/// Deletes the child elements, of one name or all, that `goes` names.
template <typename Goes>
void DeleteChildren(tinyxml2::XMLElement* parent, const char* name, const Goes& goes) {
  for (tinyxml2::XMLElement* child : ListChildren(parent, name)) {
    if (goes(*child)) parent->DeleteChild(child);
  }
}

/// Deletes the elements that `goes` names in all of a document's sections of these names.
template <typename Goes>
void DeleteInSections(tinyxml2::XMLElement* root, std::initializer_list<const char*> sections,
                      const Goes& goes) {
  for (const char* name : sections)
    for (tinyxml2::XMLElement* section : ListChildren(root, name)) DeleteChildren(section, nullptr, goes);
}

/// Calls visit for an element and all below it, in the order of the file, without recursion, since a file may
/// be of any depth. Elements that visit adds below an element are visited as well.
template <typename Element, typename Visit>
void VisitElements(Element* root, const Visit& visit) {
  for (Element* element = root; element != nullptr;) {
    visit(element);
    if (Element* const child = element->FirstChildElement()) {
      element = child;
      continue;
    }
    while (element != root && element->NextSiblingElement() == nullptr)
      element = element->Parent()->ToElement();
    element = element == root ? nullptr : element->NextSiblingElement();
  }
}

/// The elements of one name at or below an element, in the order of the file, as they are now.
template <typename Element>
std::vector<Element*> ListElements(Element* root, std::string_view name) {
  std::vector<Element*> elements;
  VisitElements(root, [&](Element* element) {
    if (element->Name() == name) elements.push_back(element);
  });
  return elements;
}

inline std::string ReadAttribute(const tinyxml2::XMLElement& element, const char* name,
                                 const std::string& otherwise = "") {
  const char* const value = element.Attribute(name);
  return value != nullptr ? value : otherwise;
}

/// Sets attributes by name.
inline void SetAttributes(const std::vector<std::pair<const char*, std::string>>& attributes,
                          tinyxml2::XMLElement* element) {
  for (const auto& [name, value] : attributes) element->SetAttribute(name, value.c_str());
}

inline std::string PrintXml(const tinyxml2::XMLDocument& document) {
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace dexcheck
