//! Metaplan: a robot's task plan and its software architecture, adapted together.
