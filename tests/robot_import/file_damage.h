// Robots' files damaged as files are: in structure, in numbers, in bytes. A seed gives the same
// files on every machine.
#pragma once

#include <random>
#include <span>
#include <string>
#include <vector>

class TiXmlDocument;
class TiXmlElement;

namespace poise {

class FileDamage {
 public:
  explicit FileDamage(unsigned seed) : random_(seed) {}

  /// XML with one to three damages; `done` gets their names, "drop element, byte".
  std::string Xml(const TiXmlDocument& whole, std::string* done);
  /// Protobuf text, line by line.
  std::string Text(const std::string& whole, std::string* done);
  /// Bytes alone, of any file.
  std::string Bytes(std::string text);

  size_t Below(size_t n);

 private:
  using Elements = std::vector<TiXmlElement*>;
  /// One of a name that stands in the document, each name as likely as another.
  TiXmlElement* Any(TiXmlDocument* document);
  /// The attribute's name; empty when there is none.
  std::string AnyAttribute(const TiXmlElement& element);
  std::string AnyToken();
  std::string AnyNameOf(TiXmlDocument* document);

  void DropElement(TiXmlDocument* document);
  void DuplicateElement(TiXmlDocument* document);
  void RenameElement(TiXmlDocument* document);
  void MoveElement(TiXmlDocument* document);
  void DropAttribute(TiXmlDocument* document);
  void RenameAttribute(TiXmlDocument* document);
  void SetAttribute(TiXmlDocument* document);
  void SetNumber(TiXmlDocument* document);
  void ChangeLength(TiXmlDocument* document);
  void SetName(TiXmlDocument* document);
  void CloseLoop(TiXmlDocument* document);
  void NestDeeply(TiXmlDocument* document);
  void RepeatOften(TiXmlDocument* document);
  void BreakMass(TiXmlDocument* document);
  void PutMesh(TiXmlDocument* document);
  void AddForeign(TiXmlDocument* document);
  std::string EntityBomb(std::string text);

  std::mt19937 random_;
};

}  // namespace poise
