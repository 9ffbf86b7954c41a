"""Operations: commands carried out at a drone, each with an answer and a row in the audit trail."""
