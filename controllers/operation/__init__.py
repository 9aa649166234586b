"""Operations: how a train uses its permission."""
